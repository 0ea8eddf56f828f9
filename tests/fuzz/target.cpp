#include "tests/fuzz/target.h"

#include <algorithm>
#include <array>

#include "tests/fuzz/targets.h"

namespace crease::fuzz {

std::span<const Target> targets() {
  static constexpr std::array kTargets = {Target{"obj", fuzz_obj},
                                          Target{"ply", fuzz_ply},
                                          Target{"off", fuzz_off},
                                          Target{"stl", fuzz_stl},
                                          Target{"gltf", fuzz_gltf},
                                          Target{"glb", fuzz_glb},
                                          Target{"weights", fuzz_weights},
                                          Target{"parameters", fuzz_parameters},
                                          Target{"parameters_json", fuzz_parameters_json},
                                          Target{"submit_message", fuzz_submit_message},
                                          Target{"job", fuzz_job},
                                          Target{"http_head", fuzz_http_head},
                                          Target{"multipart", fuzz_multipart},
                                          Target{"http", fuzz_http}};
  return kTargets;
}

const Target* find_target(std::string_view name) {
  const auto found = std::ranges::find(targets(), name, &Target::name);
  return found == targets().end() ? nullptr : &*found;
}

}  // namespace crease::fuzz
