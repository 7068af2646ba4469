// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <iostream>
#include <stdexcept>
#include <string>

namespace cuboid_mapping::bench {

/// A text file that is there when it is complete, or not at all. Opened before the work begins, so
/// that a wrong name is found early.
class ResultFile {
 public:
  explicit ResultFile(const std::string& name)
      : name_(name), partial_name_(name + ".partial"), out_(partial_name_) {
    if (!out_) throwError();
  }
  ~ResultFile() { std::remove(partial_name_.c_str()); }
  ResultFile(const ResultFile&) = delete;
  ResultFile& operator=(const ResultFile&) = delete;

  void write(const std::string& text) {
    out_ << text;
    out_.close();
    if (!out_ || std::rename(partial_name_.c_str(), name_.c_str()) != 0) throwError();
  }

 private:
  [[noreturn]] void throwError() const {
    throw std::runtime_error("cannot write " + name_ + ": " + std::strerror(errno));
  }

  std::string name_;
  std::string partial_name_;
  std::ofstream out_;
};

/// Does the work, then writes the text that it returns to a file, or prints it where there is no name.
template <typename WorkT>
void writeOrPrint(const std::string& name, WorkT work) {
  if (name.empty()) {
    std::cout << work();
    return;
  }
  ResultFile file(name);
  file.write(work());
}

}  // namespace cuboid_mapping::bench
