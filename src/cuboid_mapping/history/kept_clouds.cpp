// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/history/kept_clouds.h"

#include "cuboid_mapping/io/byte_stream.h"
#include "cuboid_mapping/io/compression.h"
#include "cuboid_mapping/io/sqlite_database.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>

namespace cuboid_mapping {
namespace {

using Points = std::vector<Eigen::Vector3f>;

constexpr float kMaxSteps = 1 << 30;
/// Level of zstd. Higher levels take twice the time, and save 2 %.
constexpr int kLevel = 1;

/// All lists of positions of a scan.
template <typename ScanT>
auto listsOf(ScanT& scan) {
  return std::array{&scan.points, &scan.no_returns, &scan.open_ends, &scan.free_points};
}

std::int32_t toSteps(float coordinate_m, double step_m) {
  return static_cast<std::int32_t>(std::lround(static_cast<double>(coordinate_m) / step_m));
}

float toMetres(std::int32_t steps, double step_m) { return static_cast<float>(steps * step_m); }

void packPoints(const Points& points, double step_m, ByteWriter& out) {
  out.writeVarint(points.size());
  // Axis by axis: neighbours of a beam are near it, and numbers of one axis are alike.
  for (int axis = 0; axis < 3; ++axis) {
    std::int32_t last = 0;
    for (const Eigen::Vector3f& point : points) {
      const std::int32_t steps = toSteps(point[axis], step_m);
      out.writeVarint(toZigzag(steps - last));
      last = steps;
    }
  }
}

Points unpackPoints(ByteReader& in, double step_m) {
  const std::uint32_t count = in.readVarint();
  if (count > in.numLeft() / 3) failCorrupted("it has fewer points than it says");
  Points points(count);
  for (int axis = 0; axis < 3; ++axis) {
    std::uint32_t last = 0;  // Wraps around in damaged bytes.
    for (Eigen::Vector3f& point : points) {
      last += static_cast<std::uint32_t>(fromZigzag(in.readVarint()));
      point[axis] = toMetres(static_cast<std::int32_t>(last), step_m);
    }
  }
  return points;
}

double checkedStep(double step_m) {
  if (step_m > 0.0 && std::isfinite(step_m)) return step_m;
  throw std::invalid_argument("the step of kept clouds must be > 0 and finite, in metres");
}

}  // namespace

void roundScan(Scan& scan, double step_m) {
  for (Points* points : listsOf(scan)) {
    const auto is_outside = [&](const Eigen::Vector3f& point) {
      return !(point.cwiseAbs().maxCoeff() < kMaxSteps * step_m) || !point.allFinite();
    };
    points->erase(std::remove_if(points->begin(), points->end(), is_outside), points->end());
    for (Eigen::Vector3f& point : *points) {
      for (int axis = 0; axis < 3; ++axis) {
        point[axis] = toMetres(toSteps(point[axis], step_m), step_m);
      }
    }
  }
}

Scan placeScan(const Eigen::Isometry3d& T_map_body, const Scan& scan_body) {
  const Eigen::Vector3d origin_map = T_map_body * scan_body.origin.cast<double>();
  Scan scan = makeScan(T_map_body, origin_map, scan_body.points, scan_body.no_returns);
  scan.open_ends = makeScan(T_map_body, origin_map, scan_body.open_ends).points;
  scan.free_points = makeScan(T_map_body, origin_map, scan_body.free_points).points;
  return scan;
}

std::string packScans(const std::vector<Scan>& scans_body, double step_m) {
  ByteWriter out;
  out.writeVarint(scans_body.size());
  for (const Scan& scan : scans_body) {
    for (int axis = 0; axis < 3; ++axis) out.writeF32(scan.origin[axis]);
    for (const Points* points : listsOf(scan)) packPoints(*points, step_m, out);
  }
  ByteWriter packed;
  packed.writeVarint(out.bytes().size());
  packed.writeBytes(compress(out.bytes(), kLevel));
  return packed.take();
}

std::vector<Scan> unpackScans(std::string_view bytes, double step_m) {
  ByteReader packed(bytes);
  const std::uint64_t size = packed.readVarint64();
  const std::string content = decompress(packed.readBytes(packed.numLeft()), size);
  ByteReader in(content);
  const std::uint32_t count = in.readVarint();
  if (count > in.numLeft() / 16) failCorrupted("it has fewer scans than it says");
  std::vector<Scan> scans(count);
  for (Scan& scan : scans) {
    for (int axis = 0; axis < 3; ++axis) scan.origin[axis] = in.readF32();
    for (Points* points : listsOf(scan)) *points = unpackPoints(in, step_m);
  }
  if (in.numLeft() > 0) failCorrupted("it goes on after its end");
  return scans;
}

// An empty file name makes a temporary file of SQLite.
KeptClouds::KeptClouds(double step_m)
    : step_m_(checkedStep(step_m)),
      database_(std::make_unique<SqliteDatabase>("", SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE)) {
  database_->run(
      "PRAGMA journal_mode = MEMORY; PRAGMA synchronous = OFF;"
      "CREATE TABLE clouds (number INTEGER PRIMARY KEY, content BLOB NOT NULL)");
}

KeptClouds::~KeptClouds() = default;

std::size_t KeptClouds::add(std::uint64_t number, const std::vector<Scan>& scans_body) {
  const std::string bytes = packScans(scans_body, step_m_);
  SqliteStatement put(*database_, "INSERT OR REPLACE INTO clouds VALUES (?, ?)");
  put.bind(1, static_cast<std::int64_t>(number));
  put.bindBytes(2, bytes);
  put.step();
  return bytes.size();
}

std::string KeptClouds::read(std::uint64_t number) const {
  SqliteStatement find(*database_, "SELECT content FROM clouds WHERE number = ?");
  find.bind(1, static_cast<std::int64_t>(number));
  if (!find.step()) {
    throw MapFileError(MapFileDefect::kCorrupted,
                       "cloud " + std::to_string(number) + " is not kept any more");
  }
  return std::string(find.bytes(0));
}

void KeptClouds::removeBefore(std::uint64_t number) {
  SqliteStatement remove(*database_, "DELETE FROM clouds WHERE number < ?");
  remove.bind(1, static_cast<std::int64_t>(number));
  remove.step();
}

void KeptClouds::clear() { database_->run("DELETE FROM clouds"); }

}  // namespace cuboid_mapping
