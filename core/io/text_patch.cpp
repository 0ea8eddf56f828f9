#include "core/io/text_patch.h"

#include <fmt/format.h>

#include "core/error.h"
#include "core/io/write_number.h"

namespace crease {
namespace {

bool is_number(std::string_view word, double value) {
  if (word.starts_with('+')) word.remove_prefix(1);
  double number = 0;
  const auto [last, error] = std::from_chars(word.data(), word.data() + word.size(), number);
  return error == std::errc{} && last == word.data() + word.size() && number == value;
}

}  // namespace

void TextPatch::replace(std::string_view word, double value) {
  if (word.empty() || is_number(word, value)) return;
  const auto start = static_cast<std::size_t>(word.data() - text_.data());
  patched_ += text_.substr(copied_, start - copied_);
  append_number(patched_, value);
  copied_ = start + word.size();
}

void TextPatch::replace_next(TextCursor& cursor, const Vec3& value) {
  for (const double coordinate : value) {
    cursor.skip_to_word();
    replace(cursor.word(), coordinate);
  }
}

std::string TextPatch::finish() {
  patched_ += text_.substr(copied_);
  copied_ = text_.size();
  return std::move(patched_);
}

void require_vertices(std::size_t in_file, const Mesh& result) {
  if (in_file == result.positions.size()) return;
  throw Error(code::kMeshCountMismatch, fmt::format("the original file has {} vertices, but the result has {}", in_file,
                                                    result.positions.size()));
}

}  // namespace crease
