// SPDX-License-Identifier: BSD-3-Clause
// Scenes of boxes, read back by yaml-cpp, urdfdom and geometric_shapes (for MoveIt), and for SDF by Boost's
// XML reader and the elements of SDF 1.6. Also map_convert, which writes them.
#include "box_scenes.h"

#include "cuboid_mapping/boxes/joined_cuboids.h"
#include "cuboid_mapping/io/map_files.h"
#include "tools/run_program.h"

#include <boost/property_tree/ptree.hpp>
#include <boost/property_tree/xml_parser.hpp>

#include <geometric_shapes/shape_operations.h>
#include <urdf_parser/urdf_parser.h>
#include <yaml-cpp/yaml.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <set>
#include <sstream>

namespace cuboid_mapping {
namespace {

using test::mentions;
using test::runProgram;
using test::TemporaryFolder;

/// A box with centre and size.
struct Box {
  Eigen::Vector3d center;
  Eigen::Vector3d size;
};
using Boxes = std::vector<Box>;

Eigen::Vector3d readRow(std::istream& in) {
  Eigen::Vector3d row;
  in >> row.x() >> row.y() >> row.z();
  return row;
}

Eigen::Vector3d toRow(const std::string& text) {
  std::istringstream in(text);
  return readRow(in);
}

/// Reads a scene without poses of objects as MoveIt does; geometric_shapes reads its shapes.
Boxes readMoveit(const std::string& text, std::string& name) {
  std::istringstream in(text);
  std::getline(in, name);
  Boxes boxes;
  for (std::string marker; in >> marker && marker != ".";) {
    EXPECT_EQ(marker, "*");
    std::string object;
    std::getline(in, object);
    EXPECT_EQ(object, " box_" + std::to_string(boxes.size()));
    unsigned num_shapes = 0;
    in >> num_shapes;
    EXPECT_EQ(num_shapes, 1U);
    const std::unique_ptr<shapes::Shape> shape(shapes::constructShapeFromText(in));
    const auto* box = dynamic_cast<const shapes::Box*>(shape.get());
    if (box == nullptr) break;
    Box read{readRow(in), {box->size[0], box->size[1], box->size[2]}};
    std::array<double, 8> turn_and_color{};
    for (double& number : turn_and_color) in >> number;
    EXPECT_EQ(turn_and_color, (std::array<double, 8>{0, 0, 0, 1, 0, 0, 0, 0}));
    boxes.push_back(read);
  }
  EXPECT_TRUE(in.good()) << "the last line is a point";
  return boxes;
}

Boxes readCurobo(const std::string& text) {
  const YAML::Node root = YAML::Load(text);
  EXPECT_EQ(root.size(), 1U);
  Boxes boxes;
  for (const auto& item : root["cuboid"]) {
    const auto dims = item.second["dims"].as<std::vector<double>>();
    const auto pose = item.second["pose"].as<std::vector<double>>();
    if (dims.size() != 3 || pose.size() != 7) return {};
    EXPECT_EQ((std::vector<double>(pose.begin() + 3, pose.end())),
              (std::vector<double>{1, 0, 0, 0}));
    boxes.push_back({Eigen::Vector3d(pose.data()), Eigen::Vector3d(dims.data())});
  }
  return boxes;
}

Boxes readUrdf(const std::string& text, std::string& link) {
  const urdf::ModelInterfaceSharedPtr model = urdf::parseURDF(text);
  if (model == nullptr || model->links_.size() != 1) return {};
  const auto root = model->getRoot();
  link = root->name;
  Boxes boxes;
  for (const auto& collision : root->collision_array) {
    const auto* box = dynamic_cast<const urdf::Box*>(collision->geometry.get());
    if (box == nullptr) return {};
    const urdf::Vector3& at = collision->origin.position;
    boxes.push_back({{at.x, at.y, at.z}, {box->dim.x, box->dim.y, box->dim.z}});
  }
  EXPECT_EQ(root->visual_array.size(), boxes.size());
  return boxes;
}

using Tree = boost::property_tree::ptree;

/// Expects only these children of an element, attributes included, all allowed by SDF 1.6.
void expectChildren(const Tree& element, const std::set<std::string>& names) {
  for (const auto& [name, child] : element) EXPECT_EQ(names.count(name), 1U) << name;
}

Boxes readSdfModel(const Tree& model) {
  expectChildren(model, {"<xmlattr>", "static", "link"});
  EXPECT_TRUE(model.get<bool>("static"));
  const Tree& link = model.get_child("link");
  expectChildren(link, {"<xmlattr>", "collision", "visual"});
  Boxes boxes;
  std::set<std::string> names;
  for (const auto& [kind, part] : link) {
    if (kind == "<xmlattr>") continue;
    expectChildren(part, {"<xmlattr>", "pose", "geometry"});
    EXPECT_TRUE(names.insert(kind + part.get<std::string>("<xmlattr>.name")).second);
    if (kind != "collision") continue;
    const std::string pose = part.get<std::string>("pose");
    EXPECT_EQ(pose.substr(pose.size() - 6), " 0 0 0");
    boxes.push_back({toRow(pose), toRow(part.get<std::string>("geometry.box.size"))});
  }
  EXPECT_EQ(names.size(), 2 * boxes.size());
  return boxes;
}

Boxes readSdf(const std::string& text, bool is_world) {
  std::istringstream in(text);
  Tree tree;
  boost::property_tree::read_xml(in, tree, boost::property_tree::xml_parser::trim_whitespace);
  const Tree& sdf = tree.get_child("sdf");
  EXPECT_EQ(sdf.get<std::string>("<xmlattr>.version"), "1.6");
  if (!is_world) return readSdfModel(sdf.get_child("model"));
  expectChildren(sdf.get_child("world"), {"<xmlattr>", "light", "model"});
  return readSdfModel(sdf.get_child("world.model"));
}

void expectBoxes(const Boxes& read, const std::vector<MetricBox>& expected,
                 const std::string& format) {
  ASSERT_EQ(read.size(), expected.size()) << format;
  for (std::size_t i = 0; i < read.size(); ++i) {
    const MetricBox& box = expected[i];
    EXPECT_LT((read[i].center - 0.5 * (box.min_m + box.max_m)).norm(), 1e-6) << format;
    EXPECT_LT((read[i].size - (box.max_m - box.min_m)).norm(), 1e-6) << format;
  }
}

BoxScene makeScene() {
  BoxScene scene;
  scene.frame_id = "hall \"A\" <&>";
  scene.boxes = {{{-1.05, 0.0, 0.1}, {2.0, 0.05, 3.0}},
                 {{150000.05, -2e5, -3.0}, {150000.1, -1e5, -2.95}}};
  return scene;
}

TEST(BoxScenes, areReadBackByOthersReaders) {
  for (const BoxScene& scene : {makeScene(), BoxScene{}}) {
    std::string name;
    expectBoxes(readMoveit(toSceneText(scene, SceneFormat::kMoveit), name), scene.boxes, "MoveIt");
    EXPECT_EQ(name, scene.frame_id);
    expectBoxes(readCurobo(toSceneText(scene, SceneFormat::kCurobo)), scene.boxes, "cuRobo");
    expectBoxes(readUrdf(toSceneText(scene, SceneFormat::kUrdf), name), scene.boxes, "URDF");
    EXPECT_EQ(name, scene.frame_id);
    expectBoxes(readSdf(toSceneText(scene, SceneFormat::kWorld), true), scene.boxes, "world");
    expectBoxes(readSdf(toSceneText(scene, SceneFormat::kSdf), false), scene.boxes, "SDF");
  }
}

TEST(BoxScenes, areNamedByTheEndOfAFile) {
  EXPECT_EQ(sceneFormatOfName("a.b/hall.SCENE"), SceneFormat::kMoveit);
  EXPECT_EQ(sceneFormatOfName("hall.yml"), SceneFormat::kCurobo);
  EXPECT_EQ(sceneFormatOfName("hall.world"), SceneFormat::kWorld);
  EXPECT_FALSE(sceneFormatOfName("hall.cuboids"));
  EXPECT_FALSE(sceneFormatOfName("scene"));
}

/// A map with two walls and a pillar at 0.1 m.
MapSnapshot makeHall() {
  MapConfig config;
  config.resolution_m = 0.1;
  CuboidMap map(config);
  for (const CellBox& box : {CellBox{{0, 0, 0}, {50, 2, 20}}, CellBox{{0, 2, 0}, {2, 50, 20}},
                             CellBox{{30, 30, 0}, {33, 33, 20}}}) {
    map.replace(box, std::vector<UniformBox>{{box, 1.0F}});
  }
  map.replace({{5, 5, 0}, {20, 20, 20}},
              std::vector<UniformBox>{{{{5, 5, 0}, {20, 20, 20}}, -1.0F}});
  return takeSnapshot(map, "hall");
}

class ConvertedBoxes : public testing::Test {
 protected:
  ConvertedBoxes() { writeMapFile(map_, makeHall()); }

  test::ProgramEnd convert(const std::string& file, std::vector<std::string> options = {}) {
    std::vector<std::string> command{MAP_CONVERT_PROGRAM, map_, folder_ / file};
    command.insert(command.end(), options.begin(), options.end());
    return runProgram(command);
  }
  [[nodiscard]] std::string read(const std::string& file) const {
    return test::readText(folder_ / file);
  }

  TemporaryFolder folder_;
  std::string map_ = folder_ / "hall.cuboids";
};

TEST_F(ConvertedBoxes, areAllJoinedCuboidsOrAsManyAsAskedFor) {
  for (const std::string ending : {"scene", "yaml", "world", "sdf", "urdf"}) {
    const test::ProgramEnd end = convert("all." + ending);
    ASSERT_EQ(end.status, 0) << end.err;
    EXPECT_TRUE(mentions(end.out, ": 3 joined cuboids")) << end.out;
  }
  std::string name;
  const Boxes all = readMoveit(read("all.scene"), name);
  EXPECT_EQ(name, "hall");
  ASSERT_EQ(all.size(), 3U);
  EXPECT_EQ(readCurobo(read("all.yaml")).size(), 3U);
  EXPECT_EQ(readSdf(read("all.world"), true).size(), 3U);
  EXPECT_EQ(readSdf(read("all.sdf"), false).size(), 3U);
  EXPECT_EQ(readUrdf(read("all.urdf"), name).size(), 3U);
  EXPECT_EQ(name, "hall");

  const test::ProgramEnd few = convert("few.scene", {"--boxes", "2"});
  ASSERT_EQ(few.status, 0) << few.err;
  EXPECT_TRUE(mentions(few.out, "2 boxes, 4.1")) << few.out;
  EXPECT_TRUE(mentions(few.out, " added")) << few.out;
  EXPECT_EQ(readMoveit(read("few.scene"), name).size(), 2U);

  const test::ProgramEnd part =
      convert("part.scene", {"--boxes", "5", "--min", "2", "2", "0", "--max", "4", "4", "1"});
  ASSERT_EQ(part.status, 0) << part.err;
  const Boxes pillar = readMoveit(read("part.scene"), name);
  ASSERT_EQ(pillar.size(), 1U);
  EXPECT_LT((pillar[0].center - Eigen::Vector3d(3.15, 3.15, 0.5)).norm(), 1e-9);
}

TEST_F(ConvertedBoxes, keepSpaceFree) {
  const std::string robot = "1 1 0 1.5 1.5 1";
  const test::ProgramEnd end = convert("free.csv", {"--boxes", "3", "--keep-free", robot});
  ASSERT_EQ(end.status, 0) << end.err;
  const test::ProgramEnd too_few = convert("free.scene", {"--boxes", "1", "--keep-free", robot});
  EXPECT_EQ(too_few.status, 1);
  EXPECT_TRUE(mentions(too_few.err, "would be")) << too_few.err;
}

TEST_F(ConvertedBoxes, ofACsvFileAreJoined) {
  ASSERT_EQ(convert("joined.csv", {"--joined"}).status, 0);
  const std::string text = read("joined.csv");
  EXPECT_EQ(std::count(text.begin(), text.end(), '\n'), 1 + 4) << text;
  EXPECT_TRUE(mentions(text, "0,0,0,5,0.2,2,0.731059,occupied\n")) << text;
  EXPECT_TRUE(mentions(text, "0.5,0.5,0,2,2,2,0.268941,free\n")) << text;
}

TEST_F(ConvertedBoxes, sayWhatIsWrong) {
  const std::vector<std::pair<std::vector<std::string>, std::string>> cases{
      {{"x.scene", "--boxes", "0"}, "--boxes 0"},
      {{"x.scene", "--boxes", "-3"}, "--boxes -3"},
      {{"x.scene", "--boxes", "nan"}, "--boxes nan"},
      {{"x.ot", "--boxes", "5"}, "--boxes is for .scene"},
      {{"x.scene", "--joined"}, "always joined"},
      {{"x.ot", "--joined"}, "--joined is for .csv"},
      {{"x.csv", "--joined", "--boxes", "5"}, "not both"},
      {{"x.csv", "--keep-free", "0 0 0 1 1 1"}, "go with --boxes"},
      {{"x.csv", "--keep-passages", "1"}, "go with --boxes"},
      {{"x.csv", "--boxes", "5", "--keep-free", "0 0 0 1 1"}, "six finite numbers"},
      {{"x.csv", "--boxes", "5", "--keep-free", "0 0 0 1 1 nan"}, "six finite numbers"},
      {{"x.csv", "--boxes", "5", "--keep-free", "0 0 0 1 1 1 1"}, "six finite numbers"},
      {{"x.scene", "--min", "0", "0", "0", "--max", "inf", "1", "1"}, "must be finite"},
      {{"x.scene", "--min", "0", "0", "nan", "--max", "1", "1", "1"}, "must be finite"},
      {{"x.doc"}, "for boxes, .scene"}};
  for (const auto& [arguments, text] : cases) {
    const test::ProgramEnd end = convert(arguments[0], {arguments.begin() + 1, arguments.end()});
    EXPECT_EQ(end.status, 1) << text;
    EXPECT_EQ(end.out, "") << text;
    EXPECT_TRUE(mentions(end.err, text)) << end.err;
    EXPECT_FALSE(std::filesystem::exists(folder_ / arguments[0]));
  }
}

TEST_F(ConvertedBoxes, areDrawnJoined) {
  const std::string picture = folder_ / "hall.ppm";
  const auto draw = [&](const std::vector<std::string>& options) {
    std::vector<std::string> command{MAP_RENDER_PROGRAM, map_, picture, "--width", "100",
                                     "--height",         "100"};
    command.insert(command.end(), options.begin(), options.end());
    return runProgram(command);
  };
  ASSERT_EQ(draw({"--color-by", "size"}).status, 0);
  const std::string tiles = test::readText(picture);
  ASSERT_EQ(draw({"--color-by", "size", "--cells", "joined"}).status, 0);
  EXPECT_NE(test::readText(picture), tiles);
  EXPECT_TRUE(mentions(draw({"--cells", "joined"}).err, "--color-by size"));
}

}  // namespace
}  // namespace cuboid_mapping
