// SPDX-License-Identifier: BSD-3-Clause
// cuboid_map.MapFollower: a copy of the map of another process.
#include "cuboid_mapping/sharing/shared_map_follower.h"

#include "arrays.h"
#include "cuboid_mapping/io/packed_bricks.h"
#include "map_access.h"

#include <algorithm>
#include <memory>
#include <stdexcept>
#include <utility>

namespace cuboid_map_python {
namespace {

using namespace cuboid_mapping;
using py::literals::operator""_a;

/// A message is damaged, or lacks a part.
struct DamagedMessage : std::invalid_argument {
  using std::invalid_argument::invalid_argument;
};

template <typename T>
T field(const py::object& message, const char* name) {
  return message.attr(name).cast<T>();
}

/// The content of a message CuboidBricks.
PackedBricks toPacked(const py::object& message) {
  PackedBricks packed;
  packed.num_bricks = field<std::uint32_t>(message, "num_bricks");
  packed.num_values = field<std::uint32_t>(message, "num_values");
  packed.has_values = field<bool>(message, "has_values");
  const auto data = py::reinterpret_steal<py::bytes>(
      PyBytes_FromObject(field<py::object>(message, "data").ptr()));
  if (!data) throw py::error_already_set();
  char* bytes = nullptr;
  py::ssize_t size = 0;
  PyBytes_AsStringAndSize(data.ptr(), &bytes, &size);
  packed.data.assign(bytes, bytes + size);
  return packed;
}

/// @param work  As in MapAccess::withMap().
template <typename WorkT>
void readVersion(const MapFollower& version, WorkT work) {
  if (version.map() == nullptr) throw std::runtime_error("no map has come yet: see has_map");
  work(*version.map());
}

constexpr char kDamagedMap[] = "the bricks of the FullCuboidMap are damaged";

MapImage join(MapImage image, const std::vector<PackedBricks>& parts) {
  for (const PackedBricks& packed : parts) {
    const bool is_like_the_first = packed.has_values == parts.front().has_values;
    const auto bricks = unpackBricks(packed);
    if (!is_like_the_first || !bricks) throw DamagedMessage(kDamagedMap);
    image.bricks.insert(image.bricks.end(), bricks->begin(), bricks->end());
  }
  return image;
}

/// One revision of a node's map.
class CopyAccess : public MapAccess {
 public:
  explicit CopyAccess(SharedMapFollower::Version version) : version_(std::move(version)) {}

  [[nodiscard]] const MapFollower& version() const { return *version_; }

 protected:
  void withMap(MapReader work) override { readVersion(*version_, work); }

 private:
  SharedMapFollower::Version version_;
};

class FollowerAccess : public MapAccess {
 public:
  /// @param parts  The bricks of the image.
  void take(const MapImage& head, const std::vector<PackedBricks>& parts) {
    const py::gil_scoped_release release;
    if (!follower_.take(join(head, parts))) throw DamagedMessage(kDamagedMap);
  }

  FollowResult take(MapDelta delta, const PackedBricks& packed) {
    const py::gil_scoped_release release;
    auto bricks = unpackBricks(packed);
    if (!bricks) return FollowResult::kDamaged;
    delta.bricks = std::move(*bricks);
    return follower_.take(std::move(delta));
  }

  [[nodiscard]] SharedMapFollower::Version version() const {
    const py::gil_scoped_release release;  // An update in place may hold the lock.
    return follower_.read();
  }

 protected:
  void withMap(MapReader work) override { readVersion(*follower_.read(), work); }

 private:
  SharedMapFollower follower_;
};

std::unique_ptr<CopyAccess> copyOf(const FollowerAccess& follower) {
  auto copy = std::make_unique<CopyAccess>(follower.version());
  copy->frame_id = follower.frame_id;
  return copy;
}

/// Frame, stamp and replacements of a message; objects with the same fields may come without these.
MapLabel labelOf(const py::object& message) {
  MapLabel label;
  label.num_replaced = py::getattr(message, "replacements", py::int_(0)).cast<std::uint64_t>();
  if (!py::hasattr(message, "header")) return label;
  const py::object header = message.attr("header");
  label.frame_id = field<std::string>(header, "frame_id");
  label.stamp_ns = header.attr("stamp").attr("to_nsec")().cast<std::int64_t>();
  return label;
}

MapImage headOf(const py::object& message) {
  MapImage head;
  head.instance = field<std::uint64_t>(message, "instance");
  head.revision = field<std::uint64_t>(message, "revision");
  head.resolution_m = field<double>(message, "resolution");
  head.label = labelOf(message);
  return head;
}

void takeMap(FollowerAccess& access, const py::object& message) {
  const bool is_one = !py::isinstance<py::list>(message) && !py::isinstance<py::tuple>(message);
  const auto parts = is_one ? py::list(py::make_tuple(message)) : py::list(message);
  if (parts.empty()) throw DamagedMessage("a FullCuboidMap has one part at least");
  const MapImage head = headOf(parts[0]);
  std::vector<PackedBricks> packed;
  for (const py::handle handle : parts) {
    const auto part = py::reinterpret_borrow<py::object>(handle);
    const MapImage other = headOf(part);
    const bool is_of_it = other.instance == head.instance && other.revision == head.revision &&
                          other.resolution_m == head.resolution_m;
    // A message of a map in one part may come without these fields.
    const auto index = py::getattr(part, "part", py::int_(0)).cast<std::size_t>();
    const auto count = py::getattr(part, "num_parts", py::int_(1)).cast<std::size_t>();
    const bool is_in_order =
        index == packed.size() && std::max<std::size_t>(count, 1) == parts.size();
    if (!is_of_it || !is_in_order) {
      throw DamagedMessage(
          "these are not all parts of one FullCuboidMap, in their order: see GetMap");
    }
    packed.push_back(toPacked(part.attr("bricks")));
  }
  access.take(head, packed);
  if (!head.label.frame_id.empty()) access.frame_id = head.label.frame_id;
}

bool takeUpdate(FollowerAccess& access, const py::object& message) {
  MapDelta head;
  head.instance = field<std::uint64_t>(message, "instance");
  head.base = field<std::uint64_t>(message, "base");
  head.revision = field<std::uint64_t>(message, "revision");
  head.is_everything = field<bool>(message, "everything");
  head.resolution_m = field<double>(message, "resolution");
  head.label = labelOf(message);
  const FollowResult result = access.take(head, toPacked(message.attr("bricks")));
  return result == FollowResult::kApplied || result == FollowResult::kOld;
}

/// Adds what a node says of its map. @param version_of  (const AccessT&) -> pointer to a MapFollower.
template <typename AccessT, typename VersionOfT>
void defineLabel(py::class_<AccessT, MapAccess>& map, VersionOfT version_of) {
  map.def_property_readonly(
      "revision", [=](const AccessT& access) { return version_of(access)->revision(); },
      "Revision of the node's map that the copy equals; 0 before the first map.");
  map.def_property_readonly(
      "instance", [=](const AccessT& access) { return version_of(access)->instance(); },
      "Number of the server's run; changes when it is restarted. 0 before the first map.");
  map.def_property_readonly(
      "replacements",
      [=](const AccessT& access) { return version_of(access)->label().num_replaced; },
      "Times that a reset, load, move or correction has replaced the node's map in this run.");
  map.def_property_readonly(
      "stamp_ns", [=](const AccessT& access) { return version_of(access)->label().stamp_ns; },
      "Stamp of the last cloud in the map, in nanoseconds; 0 before the first.");
}

}  // namespace

void bindFollower(py::module& module, const MapClass& /*map*/) {
  py::register_exception<DamagedMessage>(module, "DamagedMessage", PyExc_ValueError);
  py::class_<CopyAccess, MapAccess> copy(module, "MapCopy",
                                         R"(One revision of a node's map: MapFollower.copy().

It does not change, however long it is held. Its memory is that of the follower, until that one goes on.)");
  defineLabel(copy, [](const CopyAccess& access) { return &access.version(); });

  py::class_<FollowerAccess, MapAccess> follower(
      module, "MapFollower",
      R"(A copy of a node's map, updated by the node's messages.

Needs no ROS: a message is any object with the fields of the ROS message. Every voxel has the class that it has in the
node's map, and its log-odds if the messages carry them (~publish_values, or GetMap with_values); else those of the
clamping thresholds. Queries before the first map raise RuntimeError.

Each query is of one revision, and holds up no update; for several queries of one revision, see copy().)");
  follower.def(py::init<>());
  follower.def("take_map", takeMap, "message"_a,
               R"(Takes the message of a whole map, unless it is older than the copy.

message: FullCuboidMap, or a list of all its parts. Raises DamagedMessage, a ValueError; the copy is then as before.)");
  follower.def("take_update", takeUpdate, "message"_a, R"(Takes the message of an update.

message: CuboidMapUpdate. It may come twice, late, or not at all.
Returns False if take_map() is needed: there is no map yet, it was replaced, updates were lost, or this one is damaged.)");
  follower.def("copy", &copyOf, R"(The current revision as a MapCopy, in O(1).)");
  follower.def_property_readonly(
      "has_map",
      [](const FollowerAccess& access) {
        const auto version = access.version();
        return version->map() != nullptr && version->map()->voxels().size() > 0;
      },
      "Whether a map has come that knows a voxel.");
  defineLabel(follower, [](const FollowerAccess& access) { return access.version(); });
}

}  // namespace cuboid_map_python
