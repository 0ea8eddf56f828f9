#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

#include "core/io/ply_header.h"

namespace crease {

/// The content of a property: a coordinate (0 to 2), the weight, a part of a colour, a texture coordinate, a normal, or
/// something that is skipped.
enum PlySlot : std::size_t {
  kWeight = 3,
  kRed = 4,
  kAlpha = 7,
  kU = 8,
  kV = 9,
  kNormal = 10,
  kTexcoord = 11,
  kOther = 12
};

/// What a property holds by its name.
std::size_t slot_of(const PlyProperty& property);

/// The slots of an element's properties. Parts of what is not there as a whole, or twice, are skipped.
class PlySlots {
 public:
  explicit PlySlots(const PlyElement& element);

  std::size_t operator[](std::size_t property) const { return slots_[property]; }
  bool has_colour() const { return has_colour_; }
  bool has_texture() const { return has_texture_; }
  std::size_t count(std::size_t slot) const { return static_cast<std::size_t>(std::ranges::count(slots_, slot)); }
  void skip(std::size_t slot) { std::ranges::replace(slots_, slot, std::size_t{kOther}); }
  void skip_texture();
  /// What stands for 1 in the colours.
  float full() const { return full_; }

 private:
  bool settle(const PlyElement& element, std::size_t first, std::size_t slots);

  std::vector<std::size_t> slots_;
  bool has_colour_ = false, has_texture_ = false;
  float full_ = 1;
};

}  // namespace crease
