#include "core/io/formats.h"

#include <fmt/format.h>

#include <algorithm>

#include "core/base/text.h"

namespace crease {
namespace {

constexpr bool has_function(const Format& format) {
  return holds_mesh(format) || format.write_labels != nullptr || format.write_ridges != nullptr;
}

constexpr bool shares_a_name(const Names& a, const Names& b) {
  return std::any_of(a.begin(), a.end(),
                     [&](std::string_view name) { return std::find(b.begin(), b.end(), name) != b.end(); });
}

constexpr bool are_told_apart(const Format& a, const Format& b) {
  return a.name != b.name && !shares_a_name(a.media_types, b.media_types) && !shares_a_name(a.extensions, b.extensions);
}

constexpr bool is_sound_table() {
  for (std::size_t i = 0; i < kFormats.size(); ++i) {
    if (!has_function(kFormats[i]) || holds_mesh(kFormats[i]) != (i < kMeshFormats.size())) return false;
    for (std::size_t k = 0; k < i; ++k) {
      if (!are_told_apart(kFormats[i], kFormats[k])) return false;
    }
  }
  return true;
}

static_assert(is_sound_table(), "every row can do something, rows of meshes come first, and no two share a name");

Formats formats_of_meshes() {
  Formats formats;
  for (const MeshFormat format : kMeshFormats) formats.push_back(&format_row(format));
  return formats;
}

std::optional<MeshFormat> mesh_format_of(const Format* row) {
  if (row == nullptr) return std::nullopt;
  return static_cast<MeshFormat>(row - kFormats.data());
}

template <typename Accepts>
const Format* find_format(const Formats& formats, Accepts accepts) {
  const auto found = std::find_if(formats.begin(), formats.end(), [&](const Format* row) { return accepts(*row); });
  return found == formats.end() ? nullptr : *found;
}

bool has(const Names& names, std::string_view name) {
  return std::find(names.begin(), names.end(), name) != names.end();
}

std::string listed(const Formats& formats, std::string_view Format::*text, std::string_view conjunction) {
  std::string list;
  for (std::size_t i = 0; i < formats.size(); ++i) {
    if (i > 0) list += i + 1 < formats.size() ? ", " : fmt::format(" {} ", conjunction);
    list += formats[i]->*text;
  }
  return list;
}

}  // namespace

Formats text_first(Formats formats) {
  std::stable_partition(formats.begin(), formats.end(), [](const Format* format) { return format->is_text; });
  return formats;
}

const Format* find_by_name(const Formats& formats, std::string_view name) {
  return find_format(formats, [&](const Format& format) { return format.name == name; });
}

const Format* find_by_filename(const Formats& formats, std::string_view filename) {
  const std::string_view last = filename.substr(filename.find_last_of("/\\") + 1);
  const std::size_t dot = last.rfind('.');
  if (dot == std::string_view::npos) return nullptr;
  const std::string extension = lower(last.substr(dot + 1));
  return find_format(formats, [&](const Format& format) { return has(format.extensions, extension); });
}

const Format* find_by_media_type(const Formats& formats, std::string_view media_type) {
  const std::string wanted = lower(trimmed(media_type.substr(0, media_type.find(';'))));
  return find_format(formats, [&](const Format& format) { return has(format.media_types, wanted); });
}

std::string name_list(const Formats& formats, std::string_view conjunction) {
  return listed(formats, &Format::name, conjunction);
}

std::string title_list(const Formats& formats, std::string_view conjunction) {
  return listed(formats, &Format::title, conjunction);
}

std::optional<MeshFormat> format_from_name(std::string_view name) {
  return mesh_format_of(find_by_name(formats_of_meshes(), name));
}

std::optional<MeshFormat> format_from_filename(std::string_view filename) {
  return mesh_format_of(find_by_filename(formats_of_meshes(), filename));
}

std::optional<MeshFormat> format_from_media_type(std::string_view media_type) {
  return mesh_format_of(find_by_media_type(formats_of_meshes(), media_type));
}

std::optional<MeshFormat> sniff_format(std::string_view bytes) {
  const Sample sample(bytes);
  const Format* best = nullptr;
  Likeness most = Likeness::kUnlike;
  for (const Format& format : kFormats) {
    const Likeness likeness = format.looks_like == nullptr ? Likeness::kUnlike : format.looks_like(sample);
    if (likeness > most) {
      most = likeness;
      best = &format;
    }
  }
  return mesh_format_of(best);
}

}  // namespace crease
