#include "tests/fuzz/properties.h"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "proto/error_table.h"
#include "tests/fuzz/target.h"

namespace crease::fuzz {

void require_utf8(std::string_view text, std::string_view what) {
  const std::string shown = nlohmann::json(text).dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
  require(nlohmann::json::parse(shown).get<std::string>() == text, std::string(what) + " is UTF-8: " + shown);
}

void require_proper(const Error& error) {
  require(error.code() != code::kInternal, "what the input brings about is no fault of ours: " + error.detail());
  require(!error.detail().empty(), "a refusal says what is wrong");
  require_utf8(error.place(), "the place of a refusal");
}

void require_sound(const Mesh& mesh) {
  require(!mesh.triangles.empty(), "a mesh has faces");
  for (const Vec3& position : mesh.positions) require(position.allFinite(), "coordinates are finite");
  for (const Triangle& triangle : mesh.triangles) {
    require(std::ranges::all_of(triangle, [&](Index corner) { return corner < mesh.positions.size(); }),
            "indices are in range");
  }
}

}  // namespace crease::fuzz
