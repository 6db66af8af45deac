// SPDX-License-Identifier: Apache-2.0
#include "prefilter/vertex_fan.h"

#include <cstddef>
#include <utility>

namespace farfield {

bool is_one_fan(std::vector<LinkEdge>& link, bool is_border) {
  if (link.empty() || (!is_border && link.size() < 3)) return false;
  // Grow a chain from the first edge, at its end, then at its beginning.
  uint32_t first = link[0].a, last = link[0].b;
  std::size_t used = 1;
  const auto grow = [&](uint32_t& end) {
    for (std::size_t i = used; i < link.size(); ++i) {
      if (link[i].a != end && link[i].b != end) continue;
      end = link[i].a == end ? link[i].b : link[i].a;
      std::swap(link[i], link[used++]);
      return true;
    }
    return false;
  };
  while (first != last && grow(last)) {
  }
  while (first != last && grow(first)) {
  }
  if (used != link.size() || (first == last) == is_border) return false;
  for (std::size_t i = 0; i < link.size(); ++i) {
    std::size_t at_a = 0, at_b = 0;
    for (const LinkEdge& other : link) {
      at_a += (other.a == link[i].a) + (other.b == link[i].a);
      at_b += (other.a == link[i].b) + (other.b == link[i].b);
    }
    if (at_a > 2 || at_b > 2) return false;
  }
  return true;
}

}  // namespace farfield
