// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/parameters/nearest_key.h"

#include <boost/algorithm/string.hpp>

#include <algorithm>
#include <cstddef>
#include <numeric>

namespace cuboid_mapping_ros {
namespace {

/// The text after the last slash.
std::string lastPart(const std::string& key) { return key.substr(key.rfind('/') + 1); }

/// Levenshtein distance: characters to insert, remove or replace.
std::size_t editDistance(const std::string& a, const std::string& b) {
  std::vector<std::size_t> row(b.size() + 1);
  std::iota(row.begin(), row.end(), std::size_t{0});
  for (std::size_t i = 0; i < a.size(); ++i) {
    std::size_t diagonal = row[0];
    row[0] = i + 1;
    for (std::size_t j = 0; j < b.size(); ++j) {
      const std::size_t replaced = diagonal + (a[i] == b[j] ? 0 : 1);
      diagonal = row[j + 1];
      row[j + 1] = std::min({replaced, row[j] + 1, diagonal + 1});
    }
  }
  return row[b.size()];
}

/// The words of a key, in alphabetical order.
std::vector<std::string> partsOf(const std::string& key) {
  std::vector<std::string> words;
  boost::split(words, key, boost::is_any_of("/_"));
  std::sort(words.begin(), words.end());
  return words;
}

/// Distance of two keys, as a whole or after the last slash. A key whose words are
/// all in the other one is near: max_sensor_range is an old name of octomap_server's sensor_model/max_range.
std::size_t distanceBetween(const std::string& key, const std::string& known) {
  const auto words = partsOf(key);
  const auto known_words = partsOf(known);
  const bool is_part =
      std::includes(known_words.begin(), known_words.end(), words.begin(), words.end());
  return std::min({editDistance(key, known), editDistance(lastPart(key), lastPart(known)),
                   is_part ? std::size_t{1} : key.size()});
}

}  // namespace

std::optional<std::string> findNearestKey(const std::string& key,
                                          const std::vector<std::string>& known_keys) {
  std::optional<std::string> nearest;
  const std::size_t length = lastPart(key).size();
  std::size_t limit = std::min(length, std::max<std::size_t>(2, length / 3) + 1);
  for (const std::string& known : known_keys) {
    const std::size_t distance = distanceBetween(key, known);
    if (distance >= limit) continue;
    nearest = known;
    limit = distance;
  }
  return nearest;
}

}  // namespace cuboid_mapping_ros
