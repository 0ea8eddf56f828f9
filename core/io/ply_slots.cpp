#include "core/io/ply_slots.h"

#include <array>

namespace crease {
namespace {

struct PlySlotName {
  std::string_view name;
  std::size_t slot;
};

constexpr std::array<PlySlotName, 24> kSlotNames{{{"x", 0},
                                                  {"y", 1},
                                                  {"z", 2},
                                                  {"weight", kWeight},
                                                  {"red", kRed},
                                                  {"green", kRed + 1},
                                                  {"blue", kRed + 2},
                                                  {"alpha", kAlpha},
                                                  {"diffuse_red", kRed},
                                                  {"diffuse_green", kRed + 1},
                                                  {"diffuse_blue", kRed + 2},
                                                  {"r", kRed},
                                                  {"g", kRed + 1},
                                                  {"b", kRed + 2},
                                                  {"a", kAlpha},
                                                  {"s", kU},
                                                  {"t", kV},
                                                  {"u", kU},
                                                  {"v", kV},
                                                  {"texture_u", kU},
                                                  {"texture_v", kV},
                                                  {"nx", kNormal},
                                                  {"ny", kNormal},
                                                  {"nz", kNormal}}};

/// What stands for 1 in a colour of the type; 0 for types that hold no colours.
float full_of(PlyType type) {
  switch (type) {
    case PlyType::kUint8:
      return 255;
    case PlyType::kUint16:
      return 65535;
    case PlyType::kFloat32:
    case PlyType::kFloat64:
      return 1;
    default:
      return 0;
  }
}

}  // namespace

std::size_t slot_of(const PlyProperty& property) {
  if (property.count_type) return property.name == "texcoord" ? kTexcoord : kOther;
  const auto found = std::ranges::find(kSlotNames, property.name, &PlySlotName::name);
  return found == kSlotNames.end() ? std::size_t{kOther} : found->slot;
}

PlySlots::PlySlots(const PlyElement& element) {
  for (const PlyProperty& property : element.properties) slots_.push_back(slot_of(property));
  has_colour_ = settle(element, kRed, 3);
  if (!has_colour_ || count(kAlpha) != 1) skip(kAlpha);
  has_texture_ = settle(element, kU, 2);
}

void PlySlots::skip_texture() {
  skip(kU);
  skip(kV);
  has_texture_ = false;
}

bool PlySlots::settle(const PlyElement& element, std::size_t first, std::size_t slots) {
  float full = -1;
  bool whole = true;
  for (std::size_t slot = first; slot < first + slots; ++slot) whole = whole && count(slot) == 1;
  for (std::size_t k = 0; k < slots_.size(); ++k) {
    const bool belongs = slots_[k] >= first && (slots_[k] < first + slots || (first == kRed && slots_[k] == kAlpha));
    if (!belongs) continue;
    const float of_type = full_of(element.properties[k].type);
    whole = whole && of_type > 0 && (full < 0 || full == of_type);
    full = of_type;
  }
  whole = whole && (first == kRed || full == 1);
  if (first == kRed && whole) full_ = full;
  for (std::size_t slot = first; !whole && slot < first + slots; ++slot) skip(slot);
  return whole;
}

}  // namespace crease
