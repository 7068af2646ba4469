// SPDX-License-Identifier: BSD-3-Clause
// The part of MPI that bag_to_map_mpi needs.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

namespace cuboid_mapping_ros {

/// Bytes on their way to other ranks, see MpiRanks::startSending().
class MpiSends {
 public:
  MpiSends();
  ~MpiSends();
  MpiSends(MpiSends&& other) noexcept;
  MpiSends& operator=(MpiSends&& other) noexcept;

  /// Waits until they have been received.
  void wait();

 private:
  friend class MpiRanks;
  struct Requests;

  std::unique_ptr<Requests> requests_;
};

/// The ranks of MPI_COMM_WORLD, which run in parallel. An error of MPI ends all of them.
///
/// Every function waits until all ranks have called it, unless its comment says otherwise.
class MpiRanks {
 public:
  /// Starts MPI. A program has one object.
  MpiRanks(int& argc, char**& argv);
  /// Ends MPI.
  ~MpiRanks();
  MpiRanks(const MpiRanks&) = delete;
  MpiRanks& operator=(const MpiRanks&) = delete;

  [[nodiscard]] int rank() const { return rank_; }  ///< From 0 to size() - 1. Does not wait.
  [[nodiscard]] int size() const { return size_; }  ///< Number of ranks. Does not wait.
  [[nodiscard]] int sizeOnThisMachine() const;

  /// The value of rank 0.
  [[nodiscard]] bool isSaidByFirst(bool value) const;
  /// Sums over all ranks, at all of them.
  [[nodiscard]] std::vector<std::uint64_t> sum(std::vector<std::uint64_t> values) const;
  [[nodiscard]] double greatest(double value) const;

  /// Sends bytes to each rank. @param to  By rank; less than 2 GB in all. @return The received bytes, by rank.
  [[nodiscard]] std::vector<std::string> exchange(const std::vector<std::string>& to) const;
  /// Starts to send bytes to all other ranks. Does not wait. @param to  By rank, less than 2 GB each; they must
  /// not change until the sends have been waited for.
  [[nodiscard]] MpiSends startSending(const std::vector<std::string_view>& to) const;
  /// Receives bytes that another rank has started to send, in its order. Waits for that rank alone.
  void receiveNext(int from, std::string& bytes) const;
  /// Sends bytes of any length to rank 0, which calls receive(). Does not wait for the others.
  void sendToFirst(const std::string& bytes) const;
  /// Receives bytes from a rank. Does not wait for the other ranks.
  [[nodiscard]] std::string receive(int from) const;

  /// Ends all ranks. Does not wait.
  [[noreturn]] static void abort(int status);

 private:
  int rank_ = 0;
  int size_ = 1;
};

}  // namespace cuboid_mapping_ros
