// SPDX-License-Identifier: BSD-3-Clause
#include <cuboid_mapping/map/mapper.h>

int main() { return cuboid_mapping::Mapper().map().revision() == 0 ? 0 : 1; }
