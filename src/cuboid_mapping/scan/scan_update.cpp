// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/scan/scan_update.h"

#include "cuboid_mapping/scan/brick_cursor.h"
#include "cuboid_mapping/scan/morton.h"
#include "cuboid_mapping/scan/slab_walk.h"

#include <algorithm>
#include <cassert>
#include <cstdlib>

namespace cuboid_mapping {
namespace {

/// Distance within which voxels have a key, on each axis from the cloud's first sensor.
constexpr std::int32_t kReach = MortonOrder::kAlignment / 2;
/// Distance within which sensors have beams.
constexpr std::int32_t kSensorReach = kReach - (kMaxBeamVoxels + 1);
constexpr std::size_t kPartsPerThread = 16;
/// Prefetch distance, in marks of bricks.
constexpr std::size_t kBricksAhead = 8;

/// The cell from which the keys of a cloud count.
Cell baseOf(const Cell& first_origin) {
  Cell base;
  for (int axis = 0; axis < 3; ++axis) {
    base[axis] = (first_origin[axis] - kReach) & ~(MortonOrder::kAlignment - 1);
  }
  return base;
}

Cell toBrick(BrickKey key, const Cell& base) {
  constexpr std::uint64_t kMask = (1 << kBrickKeyBits) - 1;
  return base + Cell{static_cast<std::int32_t>(key & kMask) * kBrickEdge,
                     static_cast<std::int32_t>(key >> kBrickKeyBits & kMask) * kBrickEdge,
                     static_cast<std::int32_t>(key >> (2 * kBrickKeyBits) & kMask) * kBrickEdge};
}

void dropEmpty(ScanUpdate& update) {
  const auto is_empty = [](const BrickUpdate& brick) { return isEmpty(brick); };
  update.bricks.erase(std::remove_if(update.bricks.begin(), update.bricks.end(), is_empty),
                      update.bricks.end());
}

}  // namespace

void keepMarks(ScanUpdate& update) {
  for (BrickUpdate& brick : update.bricks) {
    brick.misses = {};
    brick.grazes = {};
  }
  dropEmpty(update);
}

void keepClears(ScanUpdate& update) {
  for (BrickUpdate& brick : update.bricks) {
    brick.misses = brick.misses.without(brick.hits);
    brick.grazes = brick.grazes.without(brick.hits);
    brick.hits = {};
  }
  dropEmpty(update);
}

ScanUpdater::ScanUpdater(const Grid& grid, const BeamRanges& ranges, int threads,
                         const BeamSampling& sampling)
    : grid_(grid),
      ranges_(ranges),
      shares_(static_cast<std::size_t>(threads)),
      sampling_(sampling) {
  assert(ranges.max_range_m > 0.0);
  assert(ranges.end_margin_m >= 0.0);
  assert(threads > 0);
  if (ranges.keep_surfaces) surfaces_.emplace(grid.resolution(), threads);
}

bool ScanUpdater::isWithinKeyRange(const RayOrigin& origin) const {
  if (!origin.cell()) return false;
  for (int axis = 0; axis < 3; ++axis) {
    const std::int64_t offset = std::int64_t{(*origin.cell())[axis]} - first_origin_[axis];
    if (std::abs(offset) > kSensorReach) return false;
  }
  return true;
}

double ScanUpdater::marginOf(const BeamSource& source, const Beams& beams, std::size_t beam,
                             double length_m) const {
  const float share = beams.marginOf(beam);
  if (beams.kind != BeamKind::kNoReturn) return endMargin(share, length_m);
  if (share == 0.0F) return 0.0;
  const Eigen::Vector3f way = beams.ends[beam] - source.scan.origin;
  return std::max(0.0, length_m - (1.0 - share) * static_cast<double>(way.norm()));
}

/// Marks a beam: misses up to the margin, if it has one, grazes from there on. The last voxel of an open end is not
/// marked.
void ScanUpdater::markBeam(const Ray& ray, double margin_m, BeamKind kind, bool is_cut,
                           Share& share) const {
  const bool has_margin = margin_m > 0.0;
  if (has_margin) {
    const MarginSlabs margin = findMarginSlabs(ray, margin_m);
    const int num_before = std::abs(margin.first - ray.start[margin.axis]);
    (void)walkRay(ray, SlabCursor(ray, base_, share.marks, margin.axis, num_before, &share.grazes));
  } else {
    (void)walkRay(ray, BrickCursor(ray, base_, share.marks));
  }
  if (kind == BeamKind::kOpenEnd && !is_cut) return;
  const Cell local_end = ray.end - base_;
  const bool is_hit = kind == BeamKind::kReturn && !is_cut;
  BeamMarks& end_marks = has_margin && !is_hit ? share.grazes : share.marks;
  BrickMarks& brick = end_marks.findOrAdd(toBrickKey(local_end));
  (is_hit ? brick.hits : brick.misses[0]).set(voxelIndex(local_end));
}

BatchMargins ScanUpdater::marginsOf(const BeamSource& source, const Beams& batch,
                                    const RayBatch& rays, Share& share) const {
  BatchMargins margins{share.grazes};
  std::uint32_t bits = rays.taken;
  if (batch.kind != BeamKind::kNoReturn) bits &= ~rays.cut;
  for (; bits != 0; bits &= bits - 1) {
    const auto i = static_cast<std::size_t>(__builtin_ctz(bits));
    const double margin_m = marginOf(source, batch, i, rays.length_m[i]);
    if (margin_m > 0.0) margins.slabs[i] = findMarginSlabs(rays.rayOf(i), margin_m);
  }
  return margins;
}

/// Marks a batch of at most RayBatch::kSize beams by markSlabs(). @return The beams that need addBeam().
std::uint32_t ScanUpdater::addBatch(const BeamSource& source, const Beams& batch,
                                    Share& share) const {
  const auto count = static_cast<int>(batch.count);
  RayBatch rays;
  computeRays(source.ray_origin, batch.ends, count, ranges_.max_range_m, rays);
  // markSlabs() marks the last voxel, too.
  if (batch.kind == BeamKind::kOpenEnd) rays.taken &= rays.cut;
  std::uint32_t marked = 0;
  if (hasMargins()) {
    const BatchMargins margins = marginsOf(source, batch, rays, share);
    marked = markSlabs(rays, base_, share.marks, 0, &margins);
  } else {
    marked = markSlabs(rays, base_, share.marks);
  }
  share.num_points += static_cast<std::size_t>(__builtin_popcount(marked));
  for (std::uint32_t hits = batch.kind == BeamKind::kReturn ? marked & ~rays.cut : 0; hits != 0;
       hits &= hits - 1) {
    const Cell local_end = rays.endOf(static_cast<std::size_t>(__builtin_ctz(hits))) - base_;
    share.marks.findOrAdd(toBrickKey(local_end)).hits.set(voxelIndex(local_end));
  }
  return ~marked & RayBatch::all(count);
}

void ScanUpdater::addBeam(const BeamSource& source, const Beams& beams, std::size_t beam,
                          Share& share) const {
  Ray ray;
  bool is_cut = false;
  if (!cutRay(source, beams.ends[beam], ray, is_cut)) {
    ++share.num_out_of_range;
  } else if (!isWithinReach(ray.start, ray.end)) {
    ++share.num_too_far;
  } else {
    ++share.num_points;
    const bool may_graze = hasMargins() && (!is_cut || beams.kind == BeamKind::kNoReturn);
    const double margin_m = may_graze ? marginOf(source, beams, beam, ray.length_m) : 0.0;
    markBeam(ray, margin_m, beams.kind, is_cut, share);
  }
}

void ScanUpdater::addBeams(const BeamSource& source, const Beams& beams, Share& share) const {
  constexpr std::size_t kBatch = RayBatch::kSize;
  for (std::size_t first = 0; first < beams.count && !isCancelled(); first += kBatch) {
    const Beams batch = beams.part(first, std::min(first + kBatch, beams.count));
    std::uint32_t left = RayBatch::all(static_cast<int>(batch.count));
    if (hasLanes()) left = addBatch(source, batch, share);
    for (; left != 0; left &= left - 1) {
      addBeam(source, batch, static_cast<std::size_t>(__builtin_ctz(left)), share);
    }
  }
}

ScanUpdater::Beams ScanUpdater::beamsOf(const Scan& scan, BeamKind kind, const float* margins) {
  const auto& ends = kind == BeamKind::kReturn     ? scan.points
                     : kind == BeamKind::kNoReturn ? scan.no_returns
                                                   : scan.open_ends;
  std::size_t num_before = kind == BeamKind::kReturn ? 0 : scan.points.size();
  if (kind == BeamKind::kNoReturn) num_before += scan.open_ends.size();
  return {ends.data(), margins == nullptr ? nullptr : margins + num_before, ends.size(), kind};
}

void ScanUpdater::addFreePoints(const RayOrigin& ray_origin,
                                const std::vector<Eigen::Vector3f>& points,
                                BeamMarks& marks) const {
  for (const Eigen::Vector3f& point : points) {
    Ray ray;
    if (!ray_origin.computeRay(point, ray) || !isWithinReach(ray.start, ray.end)) continue;
    const Cell local = ray.end - base_;
    marks.findOrAdd(toBrickKey(local)).misses[0].set(voxelIndex(local));
  }
}

void ScanUpdater::addScan(const Scan& scan, const float* margins, bool by_columns, std::size_t part,
                          std::size_t num_parts, Share& share) const {
  const BeamSource source{scan, RayOrigin(grid_, scan.anchor_map, scan.origin)};
  const RayOrigin& ray_origin = source.ray_origin;
  const std::size_t num_points =
      scan.points.size() + scan.no_returns.size() + scan.open_ends.size();
  if (!isWithinKeyRange(ray_origin)) {
    if (part == 0) (ray_origin.cell() ? share.num_too_far : share.num_out_of_range) += num_points;
    return;
  }
  if (part == 0) addFreePoints(ray_origin, scan.free_points, share.marks);
  const auto add_part = [&](const Beams& beams) {
    const std::size_t first = beams.count * part / num_parts;
    addBeams(source, beams.part(first, beams.count * (part + 1) / num_parts), share);
  };
  if (!by_columns) {
    add_part(beamsOf(scan, BeamKind::kReturn, margins));
    add_part(beamsOf(scan, BeamKind::kNoReturn, margins));
  }
  add_part(beamsOf(scan, BeamKind::kOpenEnd, margins));
}

void ScanUpdater::Share::clear() {
  marks.clear();
  grazes.clear();
  num_points = 0;
  num_out_of_range = 0;
  num_too_far = 0;
}

const ScanUpdate& ScanUpdater::compute(const Scan* first, std::size_t count) {
  update_.bricks.clear();
  update_.samples.clear();
  update_.num_points = 0;
  update_.num_out_of_range = 0;
  update_.num_too_far = 0;
  first_origin_ = Cell{0, 0, 0};
  for (std::size_t i = count; i > 0; --i) {
    const RayOrigin ray_origin(grid_, first[i - 1].anchor_map, first[i - 1].origin);
    if (ray_origin.cell()) first_origin_ = *ray_origin.cell();
  }
  base_ = baseOf(first_origin_);
  num_column_slabs_ = 0;
  for (Share& share : shares_) share.clear();
  margins_.resize(ranges_.keep_surfaces ? count : 0);
  for (std::size_t i = 0; i < margins_.size(); ++i) surfaces_->compute(first[i], margins_[i]);
  const auto margins_of = [&](std::size_t scan) {
    return margins_.empty() ? nullptr : margins_[scan].data();
  };
  std::vector<char> by_columns(count);
  for (std::size_t i = 0; i < count; ++i) {
    by_columns[i] = usesColumns(first[i], margins_of(i)) ? 1 : 0;
    if (by_columns[i] != 0) addByColumns(first[i], margins_of(i));
  }
  // Parts are small because in a cloud ordered by rings the beams of one half are several times as long.
  const std::size_t num_parts = kPartsPerThread * shares_.size();
  forEachPart(num_parts, [&](std::size_t part, Share& share) {
    for (std::size_t scan = 0; scan < count; ++scan) {
      addScan(first[scan], margins_of(scan), by_columns[scan] != 0, part, num_parts, share);
    }
  });
  parallelFor(shares_.size(), numThreads(), [&](std::size_t i) { sortMarks(shares_[i]); });
  collectBricks();
  for (std::size_t i = 0; i < count; ++i) {
    const auto samples = sampleBeams(grid_, first[i], ranges_.max_range_m, sampling_, num_scans_++);
    update_.samples.insert(update_.samples.end(), samples.begin(), samples.end());
  }
  return update_;
}

void ScanUpdater::sortMarks(Share& share) const {
  const MortonOrder morton_of(base_);
  share.order.clear();
  for (const BeamMarks* marks : {&share.marks, &share.grazes}) {
    for (std::size_t i = 0; i < marks->size(); ++i) {
      share.order.push_back(
          {morton_of(marks->key(i)), marks->key(i), &(*marks)[i], marks == &share.grazes});
    }
  }
  std::sort(share.order.begin(), share.order.end(), isBefore);
}

/// Unites the results of the threads.
void ScanUpdater::collectBricks() {
  std::vector<PlacedMarks> order;
  for (const Share& share : shares_) {
    update_.num_points += share.num_points;
    update_.num_out_of_range += share.num_out_of_range;
    update_.num_too_far += share.num_too_far;
    const auto middle = static_cast<std::ptrdiff_t>(order.size());
    order.insert(order.end(), share.order.begin(), share.order.end());
    std::inplace_merge(order.begin(), order.begin() + middle, order.end(), isBefore);
  }
  std::vector<std::size_t> firsts;  // First entry of each brick in `order`.
  for (std::size_t i = 0; i < order.size(); ++i) {
    if (i == 0 || order[i].morton != order[i - 1].morton) firsts.push_back(i);
  }
  update_.bricks.resize(firsts.size());
  firsts.push_back(order.size());
  const std::size_t num_parts = kPartsPerThread * shares_.size();
  parallelFor(num_parts, numThreads(), [&](std::size_t part) {
    const std::size_t end = update_.bricks.size() * (part + 1) / num_parts;
    for (std::size_t i = update_.bricks.size() * part / num_parts; i < end; ++i) {
      order[std::min(firsts[i] + kBricksAhead, order.size() - 1)].marks->prefetch();
      update_.bricks[i] = unite(order.data() + firsts[i], order.data() + firsts[i + 1]);
    }
  });
  dropEmpty(update_);  // A beam along a face or past an edge leaves empty bricks.
}

BrickUpdate ScanUpdater::unite(const PlacedMarks* first, const PlacedMarks* last) const {
  BrickUpdate brick{toBrick(first->key, base_), {}, {}};
  for (; first != last; ++first) {
    brick.hits |= first->marks->hits;
    (first->are_grazes ? brick.grazes : brick.misses) |= first->marks->collectMisses();
  }
  brick.grazes = brick.grazes.without(brick.hits | brick.misses);
  return brick;
}

}  // namespace cuboid_mapping
