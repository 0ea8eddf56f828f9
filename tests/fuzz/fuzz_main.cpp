#include <cstdint>
#include <cstdio>
#include <cstdlib>

#include "tests/fuzz/target.h"

// Entry point for libFuzzer. One binary contains all fuzzers. FUZZ_TARGET selects one; as an environment variable, it
// also reaches the processes that libFuzzer starts for -fork, -merge and -minimize_crash.

namespace {

const crease::fuzz::Target* target = nullptr;

}  // namespace

extern "C" int LLVMFuzzerInitialize(int* /*argc*/, char*** /*argv*/) {
  const char* name = std::getenv("FUZZ_TARGET");  // NOLINT(concurrency-mt-unsafe): before any thread
  target = crease::fuzz::find_target(name == nullptr ? "" : name);
  if (target != nullptr) return 0;
  std::fputs("FUZZ_TARGET must be one of:", stderr);
  for (const auto& known : crease::fuzz::targets()) std::fprintf(stderr, " %s", known.name.data());
  std::fputs("\n", stderr);
  std::exit(2);  // NOLINT(concurrency-mt-unsafe): before any thread
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  target->run({reinterpret_cast<const char*>(data), size});
  return 0;
}
