#pragma once

#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "core/io/read_gltf_scene.h"
#include "core/mesh/mesh.h"

namespace crease {

/// Those of a file that has been read within the limits before.
inline constexpr DecodeLimits kNoLimits{static_cast<std::size_t>(kNone), static_cast<std::size_t>(kNone)};

/// A glTF or GLB file in which vectors are replaced. Everything else stays: members that this program does not know,
/// chunks of a GLB, and the bytes behind its end.
class GltfPatchFile {
 public:
  /// `document` must outlive this.
  explicit GltfPatchFile(const gltf::Document& document);

  /// The vectors of an accessor.
  std::vector<Vec3> vectors(std::size_t accessor) const;

  /// Stores vectors and returns the accessor that has them: the same one, overwritten, where it holds floats (or
  /// normalised integers, for normals) that nobody has replaced by others; otherwise a new one.
  /// \throw Error mesh_unsupported
  std::size_t store(std::size_t accessor, const std::vector<Vec3>& values, bool are_positions);

  const nlohmann::ordered_json& original_mesh(std::size_t number) const { return meshes_.at(number); }
  /// Sets the mesh of an instance. A mesh of several instances becomes several where they differ; then copies of a node
  /// become children of it.
  void set_mesh(const gltf::MeshInstance& instance, nlohmann::ordered_json mesh);

  /// `upload` is the file that the document was read from.
  std::string finish(std::string_view upload);

 private:
  /// A buffer that changes.
  struct Copy {
    std::string bytes;
    std::vector<bool> written;
  };

  void drop_draco();
  void drop_extension(const char* name);
  void place_copies(std::size_t node, const std::vector<std::size_t>& meshes);
  void store_decoded();
  std::size_t append_view(const std::string& data);
  Copy& copy_of(std::size_t buffer);
  bool overwrite(const gltf::Elements& elements, std::size_t element_bytes, const std::string& values);
  std::size_t append(std::size_t accessor, const std::vector<Vec3>& values, bool are_positions);
  std::size_t buffer_to_extend() const;
  std::string finish_gltf(std::string_view upload) const;
  std::string finish_glb(std::string_view upload) const;

  const gltf::Document& document_;
  nlohmann::ordered_json json_;
  nlohmann::ordered_json meshes_;  ///< as they are in the upload
  std::map<std::size_t, Copy> copies_;
  std::map<std::size_t, std::vector<std::size_t>> variants_;          ///< per mesh, the meshes that it has become
  std::map<std::size_t, std::vector<std::size_t>> meshes_of_copies_;  ///< per node that has copies
};

}  // namespace crease
