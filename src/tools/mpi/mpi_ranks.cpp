// SPDX-License-Identifier: BSD-3-Clause
#include "mpi/mpi_ranks.h"

#include <mpi.h>

#include <algorithm>
#include <cstdlib>
#include <limits>
#include <stdexcept>

namespace cuboid_mapping_ros {
namespace {

/// Maximum size of a message: MPI counts bytes by int.
constexpr std::size_t kMaxMessage_bytes = std::size_t{1} << 30;

/// Tag of messages for receiveNext(); all others have 0.
constexpr int kTagOfNext = 1;

int checkedCount(std::size_t num_bytes) {
  if (num_bytes > static_cast<std::size_t>(std::numeric_limits<int>::max())) {
    throw std::length_error(
        "the observations of a round are more than MPI can send at once: use more ranks");
  }
  return static_cast<int>(num_bytes);
}

/// Offsets that follow from counts.
std::vector<int> toOffsets(const std::vector<int>& counts) {
  std::vector<int> offsets(counts.size());
  std::size_t next = 0;
  for (std::size_t i = 0; i < counts.size(); ++i) {
    offsets[i] = checkedCount(next);
    next += static_cast<std::size_t>(counts[i]);
  }
  (void)checkedCount(next);
  return offsets;
}

}  // namespace

struct MpiSends::Requests {
  std::vector<MPI_Request> all;
};

MpiSends::MpiSends() : requests_(std::make_unique<Requests>()) {}
MpiSends::~MpiSends() = default;
MpiSends::MpiSends(MpiSends&& other) noexcept = default;
MpiSends& MpiSends::operator=(MpiSends&& other) noexcept = default;

void MpiSends::wait() {
  MPI_Waitall(static_cast<int>(requests_->all.size()), requests_->all.data(), MPI_STATUSES_IGNORE);
  requests_->all.clear();
}

MpiRanks::MpiRanks(int& argc, char**& argv) {
  int provided = 0;  // There are threads, but only one calls MPI.
  MPI_Init_thread(&argc, &argv, MPI_THREAD_FUNNELED, &provided);
  MPI_Comm_rank(MPI_COMM_WORLD, &rank_);
  MPI_Comm_size(MPI_COMM_WORLD, &size_);
}

MpiRanks::~MpiRanks() { MPI_Finalize(); }

int MpiRanks::sizeOnThisMachine() const {
  MPI_Comm machine = MPI_COMM_NULL;
  MPI_Comm_split_type(MPI_COMM_WORLD, MPI_COMM_TYPE_SHARED, rank_, MPI_INFO_NULL, &machine);
  int size = 1;
  MPI_Comm_size(machine, &size);
  MPI_Comm_free(&machine);
  return size;
}

bool MpiRanks::isSaidByFirst(bool value) const {
  int said = value ? 1 : 0;
  MPI_Bcast(&said, 1, MPI_INT, 0, MPI_COMM_WORLD);
  return said != 0;
}

std::vector<std::uint64_t> MpiRanks::sum(std::vector<std::uint64_t> values) const {
  MPI_Allreduce(MPI_IN_PLACE, values.data(), static_cast<int>(values.size()), MPI_UINT64_T, MPI_SUM,
                MPI_COMM_WORLD);
  return values;
}

double MpiRanks::greatest(double value) const {
  MPI_Allreduce(MPI_IN_PLACE, &value, 1, MPI_DOUBLE, MPI_MAX, MPI_COMM_WORLD);
  return value;
}

std::vector<std::string> MpiRanks::exchange(const std::vector<std::string>& to) const {
  std::vector<int> sent(to.size());
  std::transform(to.begin(), to.end(), sent.begin(),
                 [](const std::string& bytes) { return checkedCount(bytes.size()); });
  std::vector<int> received(to.size());
  MPI_Alltoall(sent.data(), 1, MPI_INT, received.data(), 1, MPI_INT, MPI_COMM_WORLD);
  const std::vector<int> sent_at = toOffsets(sent);
  const std::vector<int> received_at = toOffsets(received);
  std::string out;
  for (const std::string& bytes : to) out += bytes;
  std::string in(
      static_cast<std::size_t>(received_at.back()) + static_cast<std::size_t>(received.back()),
      '\0');
  MPI_Alltoallv(out.data(), sent.data(), sent_at.data(), MPI_CHAR, in.data(), received.data(),
                received_at.data(), MPI_CHAR, MPI_COMM_WORLD);
  std::vector<std::string> from(to.size());
  for (std::size_t i = 0; i < from.size(); ++i) {
    from[i] =
        in.substr(static_cast<std::size_t>(received_at[i]), static_cast<std::size_t>(received[i]));
  }
  return from;
}

MpiSends MpiRanks::startSending(const std::vector<std::string_view>& to) const {
  MpiSends sends;
  for (int rank = 0; rank < size_; ++rank) {
    if (rank == rank_) continue;
    const std::string_view bytes = to[static_cast<std::size_t>(rank)];
    sends.requests_->all.push_back(MPI_REQUEST_NULL);
    MPI_Isend(bytes.data(), checkedCount(bytes.size()), MPI_CHAR, rank, kTagOfNext, MPI_COMM_WORLD,
              &sends.requests_->all.back());
  }
  return sends;
}

void MpiRanks::receiveNext(int from, std::string& bytes) const {
  MPI_Message message = MPI_MESSAGE_NULL;
  MPI_Status status;
  MPI_Mprobe(from, kTagOfNext, MPI_COMM_WORLD, &message, &status);
  int count = 0;
  MPI_Get_count(&status, MPI_CHAR, &count);
  bytes.resize(static_cast<std::size_t>(count));
  MPI_Mrecv(bytes.data(), count, MPI_CHAR, &message, MPI_STATUS_IGNORE);
}

void MpiRanks::sendToFirst(const std::string& bytes) const {
  std::uint64_t size = bytes.size();
  // Synchronous, so that messages do not pile up at rank 0.
  MPI_Ssend(&size, 1, MPI_UINT64_T, 0, 0, MPI_COMM_WORLD);
  for (std::size_t i = 0; i < bytes.size(); i += kMaxMessage_bytes) {
    const int count = checkedCount(std::min(kMaxMessage_bytes, bytes.size() - i));
    MPI_Send(&bytes[i], count, MPI_CHAR, 0, 0, MPI_COMM_WORLD);
  }
}

std::string MpiRanks::receive(int from) const {
  std::uint64_t size = 0;
  MPI_Recv(&size, 1, MPI_UINT64_T, from, 0, MPI_COMM_WORLD, MPI_STATUS_IGNORE);
  std::string bytes(size, '\0');
  for (std::size_t i = 0; i < bytes.size(); i += kMaxMessage_bytes) {
    const int count = checkedCount(std::min(kMaxMessage_bytes, bytes.size() - i));
    MPI_Recv(&bytes[i], count, MPI_CHAR, from, 0, MPI_COMM_WORLD, MPI_STATUS_IGNORE);
  }
  return bytes;
}

void MpiRanks::abort(int status) {
  MPI_Abort(MPI_COMM_WORLD, status);
  std::abort();
}

}  // namespace cuboid_mapping_ros
