#pragma once

#include <vector>

#include "core/smooth/coloring.h"
#include "core/smooth/field.h"
#include "core/smooth/metropolis.h"
#include "core/smooth/random.h"

namespace crease {

/// What the vertex process visits round each vertex (§3.2, Fig. 1), packed for the inner loop.
struct Rings {
  Rings(const Field& field);

  /// A face at the vertex: its other two corners in order, and the edge between them with the face beyond it.
  struct Face {
    Index b = kNone, c = kNone, face = kNone;
    Index rim_edge = kNone, outer_face = kNone;  ///< kNone where the rim is not interior
  };
  /// An interior edge at the vertex with the two faces beside it, numbered as they lie in the ring.
  struct Spoke {
    Index edge = kNone;
    std::uint32_t first = 0, second = 0;
  };
  std::vector<std::size_t> face_starts, spoke_starts;  ///< per vertex, one more than there are vertices
  std::vector<Face> faces;
  std::vector<Spoke> spokes;
  std::size_t largest = 0;  ///< faces at one vertex
};

/// One vertex lifted out of the field, with everything that E says of its position. Reused from visit to visit.
class VertexVisit {
 public:
  explicit VertexVisit(const Rings& rings);

  void load(const Field& field, const Rings& rings, const EnergyModel& model, Index vertex);
  /// E with the vertex at `position` minus E now.
  double delta_energy(const EnergyModel& model, const Vec3& position);
  /// Moves the vertex to the position of the last delta_energy().
  void accept(Field& field, const Rings& rings) const;

 private:
  double quadratic_energy() const;
  double square_root_energy() const;
  double prior_energy(const EnergyModel& model) const;
  void turn_faces(const Vec3& position);

  struct Spoke {
    double weight = 0;
    std::uint32_t first = 0, second = 0;
  };
  Index vertex_ = kNone;
  std::size_t face_count_ = 0;
  Vec3 measured_, old_position_, new_position_;
  double old_prior_ = 0;
  std::size_t stride_ = 0;
  std::vector<double> lanes_;  ///< rows of `stride_` numbers, one number for each face of the ring
  std::vector<Spoke> spokes_;
};

/// The vertex process (§3.2) while the labels stand still.
class VertexProcess {
 public:
  VertexProcess(Field& field, std::size_t threads);

  /// E with `vertex` at `position` minus E now.
  double delta_energy(const EnergyModel& model, Index vertex, const Vec3& position);

  /// One Metropolis pass over all vertices of faces: a displacement uniform in a cube of half-width `step`, kept with
  /// probability min(1, exp(−ΔE/T)). Normals are kept up to date.
  ProposalCount sweep(const EnergyModel& model, const Coloring& coloring, const CounterRandom& random,
                      std::uint32_t sweep_index, double temperature, double step, ThreadTeam& team);

 private:
  Field& field_;
  Rings rings_;
  std::vector<VertexVisit> visits_;  ///< one for each thread
};

}  // namespace crease
