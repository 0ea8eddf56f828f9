// Meshes a model anew, for public_models.py: remesh part|organic IN OUT FACES SEED
//
// Takes the largest component of a file that CGAL reads, and writes a file in the format that the name of OUT asks for.
// Of a part the creases stay; between them its facets count as samples of a curved surface. Ends with 1 where the
// result would be no good model: an open or coarse part, one whose creases are closer to each other than the edges are
// long.

#include <CGAL/AABB_face_graph_triangle_primitive.h>
#include <CGAL/AABB_traits.h>
#include <CGAL/AABB_tree.h>
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/IO/polygon_soup_io.h>
#include <CGAL/Polygon_mesh_processing/IO/polygon_mesh_io.h>
#include <CGAL/Polygon_mesh_processing/compute_normal.h>
#include <CGAL/Polygon_mesh_processing/connected_components.h>
#include <CGAL/Polygon_mesh_processing/measure.h>
#include <CGAL/Polygon_mesh_processing/orient_polygon_soup.h>
#include <CGAL/Polygon_mesh_processing/orientation.h>
#include <CGAL/Polygon_mesh_processing/polygon_soup_to_polygon_mesh.h>
#include <CGAL/Polygon_mesh_processing/remesh.h>
#include <CGAL/Polygon_mesh_processing/repair_degeneracies.h>
#include <CGAL/Polygon_mesh_processing/repair_polygon_soup.h>
#include <CGAL/Surface_mesh.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <exception>
#include <iterator>
#include <optional>
#include <random>
#include <stdexcept>
#include <string>
#include <vector>

namespace {

namespace pmp = CGAL::Polygon_mesh_processing;
using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Point = Kernel::Point_3;
using Vector = Kernel::Vector_3;
using Mesh = CGAL::Surface_mesh<Point>;
using Edge = Mesh::Edge_index;
using Face = Mesh::Face_index;
using Halfedge = Mesh::Halfedge_index;
using Creases = Mesh::Property_map<Edge, bool>;

constexpr double kCreaseDeg = 25;

Mesh largest_component(const std::string& file) {
  std::vector<Point> points;
  std::vector<std::vector<std::size_t>> polygons;
  if (!CGAL::IO::read_polygon_soup(file, points, polygons)) throw std::runtime_error("no mesh");
  pmp::repair_polygon_soup(points, polygons);
  pmp::orient_polygon_soup(points, polygons);
  Mesh mesh;
  pmp::polygon_soup_to_polygon_mesh(points, polygons, mesh);
  pmp::keep_largest_connected_components(mesh, 1);
  pmp::remove_degenerate_faces(mesh);
  mesh.collect_garbage();
  return mesh;
}

double length_of(const Mesh& mesh, Edge edge) {
  return std::sqrt(CGAL::squared_distance(mesh.point(mesh.vertex(edge, 0)), mesh.point(mesh.vertex(edge, 1))));
}

/// In degrees, 0 where flat.
double bend_of(const Mesh& mesh, Edge edge) {
  const Halfedge h = mesh.halfedge(edge);
  const auto apex = [&](Halfedge of) { return mesh.point(mesh.target(mesh.next(of))); };
  return 180 - std::abs(CGAL::approximate_dihedral_angle(mesh.point(mesh.source(h)), mesh.point(mesh.target(h)),
                                                         apex(h), apex(mesh.opposite(h))));
}

/// Marks creases and borders; refuses what makes no good part at this length of edges.
void mark_creases(const Mesh& mesh, double edge_length, Creases& creases) {
  constexpr double kFacetDeg = 9, kMostFacets = 0.06, kMostCreases = 1;
  constexpr std::size_t kOneOfBorder = 50;
  const double area = pmp::area(mesh);
  double facets = 0, length = 0;
  std::size_t border = 0;
  for (const Edge edge : mesh.edges()) {
    const double bend = mesh.is_border(edge) ? 0 : bend_of(mesh, edge);
    creases[edge] = mesh.is_border(edge) || bend > kCreaseDeg;
    if (mesh.is_border(edge)) {
      ++border;
    } else if (creases[edge]) {
      length += length_of(mesh, edge);
    } else if (bend > kFacetDeg) {
      const Halfedge h = mesh.halfedge(edge);
      const double both = pmp::face_area(mesh.face(h), mesh) + pmp::face_area(mesh.face(mesh.opposite(h)), mesh);
      const double along = edge_length * length_of(mesh, edge);
      if (both > along) facets += std::min(both / 2, along);
    }
  }
  if (border * kOneOfBorder > mesh.number_of_edges()) throw std::runtime_error("open");
  if (facets > kMostFacets * area) throw std::runtime_error("facets are coarse");
  if (length * edge_length > kMostCreases * area) throw std::runtime_error("details are fine");
}

/// Smooth between the creases of a part: Phong tessellation [Boubekeur & Alexa 2008].
class CurvedSurface {
 public:
  CurvedSurface(const Mesh& mesh, const Creases& creases)
      : mesh_(mesh), tree_(faces(mesh_).begin(), faces(mesh_).end(), mesh_), corners_(mesh.number_of_faces()) {
    for (const Face face : mesh_.faces()) {
      auto corner = corners_[face].begin();
      for (const Halfedge h : CGAL::halfedges_around_face(mesh_.halfedge(face), mesh_)) {
        *corner++ = {mesh_.point(mesh_.target(h)), normal_of(h, creases)};
      }
    }
  }

  /// From a point of the mesh to the curved surface; at creases the way of each side, added up.
  Vector shift_of(const Point& point, double edge_length) const {
    constexpr double kNear = 1e-5, kFarthest = 0.3;
    const Vector reach(kNear * edge_length, kNear * edge_length, kNear * edge_length);
    std::vector<Face> near;
    tree_.all_intersected_primitives(Kernel::Iso_cuboid_3(point - reach, point + reach), std::back_inserter(near));
    std::vector<Side> sides;
    for (const Face face : near) add(shift_on(face, point), sides);
    Vector sum = CGAL::NULL_VECTOR;
    for (const Side& side : sides) sum += side.shift / side.count;
    const double length = std::sqrt(sum.squared_length()), farthest = kFarthest * edge_length;
    return length > farthest ? sum * (farthest / length) : sum;
  }

 private:
  struct Corner {
    Point place;
    Vector normal;
  };
  struct Side {
    Vector normal, shift;
    int count = 1;
  };

  Vector weighted_normal(Halfedge h) const {
    const Point& corner = mesh_.point(mesh_.target(h));
    const double angle =
        CGAL::approximate_angle(mesh_.point(mesh_.source(h)), corner, mesh_.point(mesh_.target(mesh_.next(h))));
    const Face face = mesh_.face(h);
    return angle * pmp::face_area(face, mesh_) * pmp::compute_face_normal(face, mesh_);
  }

  /// At the target of `h`, of its face and those around the corner that no crease parts from it.
  Vector normal_of(Halfedge h, const Creases& creases) const {
    Vector sum = weighted_normal(h);
    const auto unit = [&] { return sum / std::sqrt(sum.squared_length()); };
    for (Halfedge turned = h; !creases[mesh_.edge(turned)]; sum += weighted_normal(turned)) {
      turned = mesh_.prev(mesh_.opposite(turned));
      if (turned == h) return unit();
    }
    for (Halfedge turned = h; !creases[mesh_.edge(mesh_.next(turned))]; sum += weighted_normal(turned)) {
      turned = mesh_.opposite(mesh_.next(turned));
    }
    return unit();
  }

  Side shift_on(Face face, const Point& point) const {
    constexpr double kShare = 0.75;
    const auto& [a, b, c] = corners_[face];
    const Vector x = b.place - a.place, y = c.place - a.place, way = point - a.place;
    const double xx = x * x, xy = x * y, yy = y * y, determinant = xx * yy - xy * xy;
    const double u = std::clamp((yy * (x * way) - xy * (y * way)) / determinant, 0.0, 1.0);
    const double v = std::clamp((xx * (y * way) - xy * (x * way)) / determinant, 0.0, 1 - u);
    Side side{CGAL::NULL_VECTOR, CGAL::NULL_VECTOR};
    const auto add_corner = [&](const Corner& corner, double weight) {
      side.normal += weight * corner.normal;
      side.shift -= kShare * weight * ((point - corner.place) * corner.normal) * corner.normal;
    };
    add_corner(a, 1 - u - v);
    add_corner(b, u);
    add_corner(c, v);
    return side;
  }

  static void add(const Side& one, std::vector<Side>& sides) {
    const double alike = std::cos(kCreaseDeg * CGAL_PI / 180);
    for (Side& side : sides) {
      if (side.normal * one.normal < alike * std::sqrt(side.normal.squared_length() * one.normal.squared_length())) {
        continue;
      }
      side.shift += one.shift;
      ++side.count;
      return;
    }
    sides.push_back(one);
  }

  using Primitive = CGAL::AABB_face_graph_triangle_primitive<Mesh>;
  Mesh mesh_;
  CGAL::AABB_tree<CGAL::AABB_traits<Kernel, Primitive>> tree_;
  std::vector<std::array<Corner, 3>> corners_;
};

void remesh(Mesh& mesh, double edge_length, Creases& creases, std::mt19937& random) {
  const auto parameters = [&] { return CGAL::parameters::edge_is_constrained_map(creases).protect_constraints(true); };
  std::vector<Edge> long_edges;
  std::ranges::copy_if(mesh.edges(), std::back_inserter(long_edges), [&](Edge edge) { return creases[edge]; });
  pmp::split_long_edges(long_edges, edge_length * 4 / 3, mesh, CGAL::parameters::edge_is_constrained_map(creases));
  const unsigned relaxations = random() % 2 == 0 ? 1 : random() % 4;
  pmp::isotropic_remeshing(mesh.faces(), edge_length, mesh,
                           parameters().number_of_iterations(2 + random() % 5).number_of_relaxation_steps(relaxations));
  if (random() % 2 == 0) pmp::isotropic_remeshing(mesh.faces(), edge_length, mesh, parameters());
}

void run(bool is_part, const std::string& in, const std::string& out, double faces, std::uint32_t seed) {
  Mesh mesh = largest_component(in);
  const double edge_length = std::sqrt(pmp::area(mesh) / faces * 4 / std::sqrt(3.0));
  Creases creases = mesh.add_property_map<Edge, bool>("e:crease", false).first;
  std::optional<CurvedSurface> curved;
  if (is_part) {
    mark_creases(mesh, edge_length, creases);
    curved.emplace(mesh, creases);
  }
  std::mt19937 random(seed);
  remesh(mesh, edge_length, creases, random);
  mesh.collect_garbage();
  if (curved) {
    for (const auto v : mesh.vertices()) mesh.point(v) += curved->shift_of(mesh.point(v), edge_length);
  }
  if (CGAL::is_closed(mesh) && pmp::volume(mesh) < 0) pmp::reverse_face_orientations(mesh);
  constexpr int kDigits = 9;
  if (!CGAL::IO::write_polygon_mesh(out, mesh, CGAL::parameters::stream_precision(kDigits))) {
    throw std::runtime_error("cannot write " + out);
  }
}

}  // namespace

int main(int count, char** arguments) try {
  const std::vector<std::string> words(arguments + 1, arguments + count);
  if (words.size() != 5 || (words[0] != "part" && words[0] != "organic")) {
    std::fputs("usage: remesh part|organic IN OUT FACES SEED\n", stderr);
    return 2;
  }
  run(words[0] == "part", words[1], words[2], std::stod(words[3]), static_cast<std::uint32_t>(std::stoul(words[4])));
} catch (const std::exception& error) {
  std::fprintf(stderr, "%s\n", error.what());
  return 1;
} catch (...) {  // CGAL throws other things, too
  return 1;
}
