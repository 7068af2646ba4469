// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/io/octomap_files.h"

#include "cuboid_mapping/io/octree_stream.h"
#include "cuboid_mapping/io/text.h"

#include <optional>

namespace cuboid_mapping {
namespace {

constexpr std::string_view kFullFirstLine = "# Octomap OcTree file";
constexpr std::string_view kBinaryFirstLine = "# Octomap OcTree binary file";

[[noreturn]] void fail(MapFileDefect defect, const std::string& text) {
  throw MapFileError(defect, text);
}

struct OctreeHeader {
  bool is_binary = false;
  std::string id;
  std::optional<std::uint64_t> num_nodes;
  std::optional<double> resolution_m;
  std::size_t end = 0;  ///< Offset of the first node.
};

/// Takes the next line. @throws kTruncated if no line ends there.
std::string_view takeLine(std::string_view bytes, std::size_t& position) {
  const std::size_t end = bytes.find('\n', position);
  if (end == std::string_view::npos) {
    fail(MapFileDefect::kTruncated, "ends in its header: it was not copied or written completely");
  }
  std::string_view line = bytes.substr(position, end - position);
  position = end + 1;
  if (!line.empty() && line.back() == '\r') line.remove_suffix(1);
  return line;
}

OctreeHeader readHeader(std::string_view bytes) {
  OctreeHeader header;
  header.is_binary = takeLine(bytes, header.end) == kBinaryFirstLine;
  for (;;) {
    std::vector<std::string> words = wordsOf(std::string(takeLine(bytes, header.end)));
    words.resize(2);
    const std::string& key = words[0];
    const std::string& value = words[1];
    if (key == "data") break;
    if (key == "id") header.id = value;
    if (key == "size") header.num_nodes = parseNumber<std::uint64_t>(value);
    if (key == "res") header.resolution_m = parseNumber<double>(value);
  }
  if (header.id.empty() || !header.num_nodes || !header.resolution_m) {
    fail(MapFileDefect::kCorrupted, "is damaged: id, size or res is missing in its header");
  }
  return header;
}

/// Bytes of a node of a full tree after log-odds and children.
std::size_t extraBytesOf(const std::string& id) {
  if (id == "OcTree" || id == "OcTreeStamped") return 0;
  if (id == "ColorOcTree") return 3;
  fail(MapFileDefect::kForeign,
       "holds an octree of type '" + id + "': only OcTree, OcTreeStamped and ColorOcTree are read");
}

OctreeContent readNodes(const OctreeHeader& header, std::string_view nodes,
                        const SensorModel& model, const SnapshotLimits& limits) {
  const std::size_t extra_bytes = extraBytesOf(header.id);
  // Two bytes describe eight children; a node of a full tree has five bytes and more.
  const std::uint64_t most =
      header.is_binary ? nodes.size() * 4 + 1 : nodes.size() / (5 + extra_bytes);
  if (*header.num_nodes > most) {
    const bool is_plausible = *header.num_nodes <= std::uint64_t{1} << 32;
    fail(is_plausible ? MapFileDefect::kTruncated : MapFileDefect::kTooBig,
         "claims " + std::to_string(*header.num_nodes) + " nodes in " +
             counted(nodes.size(), "byte") +
             ": it was not copied or written completely, or is damaged");
  }
  // A leaf takes less memory than a brick.
  const std::size_t max_nodes = 4 * limits.max_bricks;
  if (header.is_binary) return readBinaryOctree(nodes, model.min(), model.max(), max_nodes);
  return readFullOctree(nodes, extra_bytes, max_nodes);
}

}  // namespace

bool isOctomapFile(std::string_view bytes) {
  constexpr std::string_view kStart = "# Octomap OcTree ";
  return bytes.substr(0, kStart.size()) == kStart;
}

std::string toOctomapFile(const MapSnapshot& snapshot, OctreeKind kind) {
  OctreeStream tree = toOctreeStream(snapshot.bricks, kind);
  if (tree.num_left_out > 0.0) {
    fail(MapFileDefect::kTooBig,
         "cannot hold the map: OctoMap's files reach 32768 voxels from the origin, and it has " +
             counted(static_cast<std::uint64_t>(tree.num_left_out), "voxel") +
             " beyond: use the native format");
  }
  std::string file(kind == OctreeKind::kFull ? kFullFirstLine : kBinaryFirstLine);
  file += "\n# (feel free to add / change comments, but leave the first line as it is!)\n#\n";
  file += "id OcTree\nsize " + std::to_string(tree.num_nodes) + "\nres " +
          toExactText(snapshot.resolution_m) + "\ndata\n";
  tree.bytes.insert(0, file);  // Without a copy: it can be larger than the map.
  return std::move(tree.bytes);
}

MapSnapshot fromOctomapFile(std::string_view bytes, const SensorModelConfig& model,
                            const SnapshotLimits& limits) {
  if (!isOctomapFile(bytes)) {
    fail(MapFileDefect::kForeign, "is not an OctoMap file: its first line is not OctoMap's");
  }
  const OctreeHeader header = readHeader(bytes);
  MapSnapshot snapshot;
  snapshot.resolution_m = *header.resolution_m;
  snapshot.sensor_model = model;
  const OctreeContent content =
      readNodes(header, bytes.substr(header.end), SensorModel(snapshot.sensor_model), limits);
  if (content.num_nodes != *header.num_nodes) {
    fail(MapFileDefect::kCorrupted, "is damaged: its header says " +
                                        std::to_string(*header.num_nodes) + " nodes, but has " +
                                        std::to_string(content.num_nodes));
  }
  snapshot.bricks = bricksOf(content.leaves, limits);
  throwIfFaulty(snapshot, limits);
  return snapshot;
}

}  // namespace cuboid_mapping
