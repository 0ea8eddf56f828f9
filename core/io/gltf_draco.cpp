#include "core/io/gltf_draco.h"

#include <draco/compression/decode.h>
#include <draco/compression/point_cloud/point_cloud_decoder.h>
#include <draco/core/varint_decoding.h>
#include <draco/metadata/metadata_decoder.h>
#include <fmt/format.h>

#include "core/error.h"
#include "core/io/mesh_builder.h"
#include "core/io/write_number.h"

namespace crease::gltf {
namespace {

constexpr std::uint16_t kFirstWithVarints = DRACO_BITSTREAM_VERSION(2, 2), kMetadataFlag = 0x8000;

[[noreturn]] void fail_damaged(const std::string& place) {
  throw Error(code::kMeshSyntax, "the data that Draco has compressed is damaged", place);
}

draco::DecoderBuffer buffer_of(std::string_view compressed) {
  draco::DecoderBuffer buffer;
  buffer.Init(compressed.data(), compressed.size());
  return buffer;
}

/// Draco reserves memory for the counts in its header, so that these are checked first.
void check_counts(std::string_view compressed, const DecodeLimits& limits, const std::string& place) {
  draco::DecoderBuffer buffer = buffer_of(compressed);
  draco::DracoHeader header{};
  if (!draco::PointCloudDecoder::DecodeHeader(&buffer, &header).ok()) fail_damaged(place);
  const auto version = static_cast<std::uint16_t>(DRACO_BITSTREAM_VERSION(header.version_major, header.version_minor));
  if (header.encoder_type != draco::TRIANGULAR_MESH || version < kFirstWithVarints) {
    throw Error(code::kMeshUnsupported,
                fmt::format("the compressed data must be a mesh of Draco 2.2, not of {}.{}", header.version_major,
                            header.version_minor),
                place);
  }
  buffer.set_bitstream_version(version);
  draco::GeometryMetadata metadata;
  if ((header.flags & kMetadataFlag) != 0 && !draco::MetadataDecoder().DecodeGeometryMetadata(&buffer, &metadata)) {
    fail_damaged(place);
  }
  std::uint32_t first = 0, second = 0;
  const bool is_edgebreaker = header.encoder_method == draco::MESH_EDGEBREAKER_ENCODING;
  if (is_edgebreaker) buffer.Advance(1);  // the kind of its traversal
  if (!draco::DecodeVarint(&first, &buffer) || !draco::DecodeVarint(&second, &buffer)) fail_damaged(place);
  const std::size_t faces = is_edgebreaker ? second : first, vertices = is_edgebreaker ? first : second;
  if (faces > limits.max_faces) MeshBuilder::fail_too_large("faces", limits.max_faces, place);
  if (vertices > limits.max_vertices) MeshBuilder::fail_too_large("vertices", limits.max_vertices, place);
}

template <typename Number>
std::string elements_of(const draco::PointAttribute& attribute, const DracoAttribute& wanted,
                        const std::string& place) {
  std::string bytes;
  bytes.reserve(wanted.count * wanted.components * sizeof(Number));
  std::array<Number, 4> element{};
  for (std::size_t i = 0; i < wanted.count; ++i) {
    const auto value = attribute.mapped_index(draco::PointIndex(static_cast<std::uint32_t>(i)));
    if (value.value() >= attribute.size() ||
        !attribute.ConvertValue(value, static_cast<std::int8_t>(wanted.components), element.data())) {
      fail_damaged(place);
    }
    for (std::size_t k = 0; k < wanted.components; ++k) append_little_endian(bytes, element[k]);
  }
  return bytes;
}

std::string elements_of(const draco::PointAttribute& attribute, const DracoAttribute& wanted) {
  switch (wanted.component) {
    case Component::kInt8:
      return elements_of<std::int8_t>(attribute, wanted, wanted.place);
    case Component::kUint8:
      return elements_of<std::uint8_t>(attribute, wanted, wanted.place);
    case Component::kInt16:
      return elements_of<std::int16_t>(attribute, wanted, wanted.place);
    case Component::kUint16:
      return elements_of<std::uint16_t>(attribute, wanted, wanted.place);
    case Component::kUint32:
      return elements_of<std::uint32_t>(attribute, wanted, wanted.place);
    case Component::kFloat:
      break;
  }
  return elements_of<float>(attribute, wanted, wanted.place);
}

}  // namespace

DracoPrimitive decode_draco(std::string_view compressed, const std::vector<DracoAttribute>& attributes,
                            const DecodeLimits& limits, const std::string& place) {
  check_counts(compressed, limits, place);
  draco::DecoderBuffer buffer = buffer_of(compressed);
  draco::Decoder decoder;
  auto decoded = decoder.DecodeMeshFromBuffer(&buffer);
  if (!decoded.ok()) fail_damaged(place);
  const std::unique_ptr<draco::Mesh> mesh = std::move(decoded).value();

  DracoPrimitive primitive;
  for (const DracoAttribute& wanted : attributes) {
    const draco::PointAttribute* attribute = mesh->GetAttributeByUniqueId(wanted.id);
    if (attribute == nullptr || wanted.components != static_cast<std::size_t>(attribute->num_components())) {
      throw Error(code::kMeshSyntax,
                  fmt::format("the compressed data has no attribute {} of {} components", wanted.id, wanted.components),
                  wanted.place);
    }
    if (wanted.count != mesh->num_points()) {
      throw Error(
          code::kMeshCountMismatch,
          fmt::format("the compressed data has {} vertices, but the accessor {}", mesh->num_points(), wanted.count),
          wanted.place);
    }
    primitive.attributes.push_back(elements_of(*attribute, wanted));
  }
  primitive.indices.reserve(std::size_t{3} * mesh->num_faces());
  for (std::uint32_t face = 0; face < mesh->num_faces(); ++face) {
    for (const draco::PointIndex& point : mesh->face(draco::FaceIndex(face))) {
      primitive.indices.push_back(point.value());
    }
  }
  return primitive;
}

}  // namespace crease::gltf
