#pragma once

#include <array>
#include <cstdint>

namespace crease {

/// Which field a random number is for; keeps the streams of one seed apart.
enum class RandomStream : std::uint32_t {
  kVertexProcess = 1,
  kEdgeProcess = 2,
  kNoise = 3,
  kFaceProcess = 4,
  kProbe = 5,
  kPosterior = 6
};

/// Four random words for a site: Philox-4x32-10 [Salmon et al. 2011], a bijection of the counter under the key. Every
/// site of every sweep has words of its own, so that results do not depend on the order of visits or on threads.
class CounterRandom {
 public:
  using Words = std::array<std::uint32_t, 4>;
  template <std::size_t kSites>
  using WordsOf = std::array<std::array<std::uint32_t, kSites>, 4>;

  constexpr CounterRandom(std::uint32_t seed, RandomStream stream) : key_{seed, static_cast<std::uint32_t>(stream)} {}

  /// Words number `draw` of `site` in `sweep`.
  constexpr Words operator()(std::uint32_t sweep, std::uint32_t site, std::uint32_t draw = 0) const {
    return philox({site, sweep, draw, 0}, key_);
  }

  /// Word w of many sites at once is `result[w][k]`, k counting the sites; draw 0.
  template <std::size_t kSites>
  constexpr WordsOf<kSites> operator()(std::uint32_t sweep, const std::array<std::uint32_t, kSites>& sites) const {
    WordsOf<kSites> words{sites};
    words[1].fill(sweep);
    mix<kSites>(words, key_);
    return words;
  }

  /// The generator itself.
  static constexpr Words philox(Words counter, std::array<std::uint32_t, 2> key) {
    WordsOf<1> words{{{counter[0]}, {counter[1]}, {counter[2]}, {counter[3]}}};
    mix<1>(words, key);
    return {words[0][0], words[1][0], words[2][0], words[3][0]};
  }

  /// A word as a number in (0, 1), never at an end.
  static constexpr double unit(std::uint32_t word) { return (static_cast<double>(word) + 0.5) * 0x1p-32; }
  /// A word as a number in (−1, 1).
  static constexpr double symmetric(std::uint32_t word) { return 2 * unit(word) - 1; }

 private:
  template <std::size_t kSites>
  static constexpr void mix(WordsOf<kSites>& words, std::array<std::uint32_t, 2> key) {
    for (int round = 0; round < 10; ++round) {
      for (std::size_t k = 0; k < kSites; ++k) {
        const std::uint64_t product0 = std::uint64_t{0xD2511F53} * words[0][k];
        const std::uint64_t product1 = std::uint64_t{0xCD9E8D57} * words[2][k];
        words[0][k] = static_cast<std::uint32_t>(product1 >> 32) ^ words[1][k] ^ key[0];
        words[2][k] = static_cast<std::uint32_t>(product0 >> 32) ^ words[3][k] ^ key[1];
        words[1][k] = static_cast<std::uint32_t>(product1);
        words[3][k] = static_cast<std::uint32_t>(product0);
      }
      key[0] += 0x9E3779B9U;
      key[1] += 0xBB67AE85U;
    }
  }

  std::array<std::uint32_t, 2> key_;
};

}  // namespace crease
