// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/fusion/growth_rules.h"

#include <gtest/gtest.h>

#include <string>

namespace cuboid_mapping {
namespace {

std::string textOf(const SearchDirections& directions) {
  std::string text;
  for (const SearchDirection& direction : directions) {
    text += text.empty() ? "" : " ";
    text += direction.sign > 0 ? '+' : '-';
    text += "xyz"[direction.axis];
  }
  return text;
}

TEST(PaperDirections, ofACubeAreFixed) {
  EXPECT_EQ(textOf(paperDirections({1, 1, 1})), "+x +y +z -x -y -z");
  EXPECT_EQ(textOf(paperDirections({5, 5, 5})), "+x +y +z -x -y -z");
}

TEST(PaperDirections, ofACuboidGoByDecreasingWidth) {
  EXPECT_EQ(textOf(paperDirections({1, 2, 3})), "+z +y +x -z -y -x");
  EXPECT_EQ(textOf(paperDirections({1, 3, 2})), "+y +z +x -y -z -x");
  EXPECT_EQ(textOf(paperDirections({2, 1, 3})), "+z +x +y -z -x -y");
  EXPECT_EQ(textOf(paperDirections({2, 3, 1})), "+y +x +z -y -x -z");
  EXPECT_EQ(textOf(paperDirections({3, 1, 2})), "+x +z +y -x -z -y");
  EXPECT_EQ(textOf(paperDirections({3, 2, 1})), "+x +y +z -x -y -z");
}

TEST(PaperDirections, ofEqualWidthsGoByName) {
  EXPECT_EQ(textOf(paperDirections({1, 1, 2})), "+z +x +y -z -x -y");
  EXPECT_EQ(textOf(paperDirections({1, 2, 1})), "+y +x +z -y -x -z");
  EXPECT_EQ(textOf(paperDirections({2, 1, 1})), "+x +y +z -x -y -z");
  EXPECT_EQ(textOf(paperDirections({1, 2, 2})), "+y +z +x -y -z -x");
  EXPECT_EQ(textOf(paperDirections({2, 1, 2})), "+x +z +y -x -z -y");
  EXPECT_EQ(textOf(paperDirections({2, 2, 1})), "+x +y +z -x -y -z");
}

TEST(PaperDirections, areAllSixForEveryWidthVector) {
  for (int x = 1; x <= 4; ++x) {
    for (int y = 1; y <= 4; ++y) {
      for (int z = 1; z <= 4; ++z) {
        const Cell width{x, y, z};
        const SearchDirections directions = paperDirections(width);
        for (std::size_t i = 0; i < 3; ++i) {
          EXPECT_EQ(directions[i].sign, 1);
          EXPECT_EQ(directions[i + 3].sign, -1);
          EXPECT_EQ(directions[i].axis, directions[i + 3].axis);
          const int axis_before = directions[i == 0 ? 0 : i - 1].axis;
          EXPECT_GE(width[axis_before], width[directions[i].axis]) << width;
        }
        EXPECT_EQ(directions[0].axis + directions[1].axis + directions[2].axis, 3);
      }
    }
  }
}

TEST(SlabOf, isWhatAnExpansionAdds) {
  const CellBox box{{0, 0, 0}, {2, 3, 4}};
  EXPECT_EQ(slabOf(box, {0, 1}, 1), (CellBox{{2, 0, 0}, {3, 3, 4}}));
  EXPECT_EQ(slabOf(box, {1, -1}, 1), (CellBox{{0, -1, 0}, {2, 0, 4}}));
  EXPECT_EQ(slabOf(box, {2, 1}, 4), (CellBox{{0, 0, 4}, {2, 3, 8}}));
  EXPECT_EQ(slabOf(box, {0, -1}, 2), (CellBox{{-2, 0, 0}, {0, 3, 4}}));
}

}  // namespace
}  // namespace cuboid_mapping
