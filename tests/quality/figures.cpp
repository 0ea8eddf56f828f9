// Reproduces Figures 3 to 6 of the paper as pictures and numbers. `tests/quality/figures.sh` builds and runs this.

#include <fmt/format.h>

#include <fstream>
#include <iostream>
#include <map>

#include "core/io/decode.h"
#include "core/measure/measure.h"
#include "core/measure/noise.h"
#include "core/smooth/classical/classical.h"
#include "core/smooth/smooth.h"
#include "core/solve/face_process.h"
#include "tests/quality/render.h"
#include "tests/support/meshes.h"

namespace crease::quality {
namespace {

constexpr int kSize = 520;
constexpr Color kRidgeColor{0.85F, 0.1F, 0.1F}, kNormalColor{0.1F, 0.25F, 0.8F};
constexpr double kDegrees = 180 / 3.14159265358979;
/// Dihedral angles in degrees of the original's subtle ridges. They are visible, but most methods do not keep them.
constexpr double kSubtleFrom = 14, kSubtleTo = 30;

struct Result {
  Mesh mesh;
  std::vector<double> labels;  ///< per edge; empty for none
};

/// A model, its noise, and the directory for the figure.
class Figure {
 public:
  Figure(int number, Mesh original, Mesh noisy, View view, std::filesystem::path directory)
      : number_(number),
        original_(std::move(original)),
        noisy_(std::move(noisy)),
        topology_(build_topology(noisy_)),
        angles_(signed_dihedral_angles(original_, topology_, original_.positions)),
        view_(std::move(view)),
        directory_(std::move(directory)) {
    view_.box = original_.positions;
  }

  const Mesh& original() const { return original_; }
  const Mesh& noisy() const { return noisy_; }
  const Topology& topology() const { return topology_; }
  const std::vector<double>& angles() const { return angles_; }

  Result smoothed(const Method& method) const {
    RunContext context;
    SmoothResult result = smooth(noisy_, topology_, {method}, context);
    return {{std::move(result.positions), noisy_.triangles}, std::move(result.labels)};
  }

  /// Adds a picture and its row of numbers.
  void add(const std::string& name, const std::string& caption, const Result& result, std::vector<Line> lines = {}) {
    for (std::size_t e = 0; e < result.labels.size(); ++e) {
      if (!is_ridge(result.labels[e])) continue;
      const auto [v0, v1] = topology_.edges[e];
      lines.push_back({result.mesh.positions[v0], result.mesh.positions[v1], kRidgeColor});
    }
    const std::string file = fmt::format("fig{}-{}.png", number_, name);
    render(result.mesh, lines, view_, kSize, directory_ / file);
    pictures_ += fmt::format("| ![{}]({}) ", caption, file);
    captions_ += fmt::format("| {} ", caption);
    const EdgeLabels labels{topology_.edges, result.labels};
    const Measurement m = measure(original_, result.mesh, result.labels.empty() ? nullptr : &labels);
    rows_ += fmt::format("| {} | {:.2f} | {:.3f} | {} | {} | {:.1f} |\n", caption, m.mean_normal_error_deg,
                         m.mean_vertex_error, m.labels ? fmt::format("{:.3f}", m.labels->f1) : "",
                         result.labels.empty() ? "" : fmt::format("{:.2f}", subtle_recall(result.labels)),
                         subtle_angle(result.mesh));
    ++count_;
  }

  void write(const std::string& title, const std::string& text) const {
    std::string line = "|";
    for (int i = 0; i < count_; ++i) line += " --- |";
    std::ofstream page(directory_ / fmt::format("fig{}.md", number_));
    page << fmt::format(
        "## Figure {}: {}\n\n{}\n\n{}|\n{}\n{}|\n\n"
        "| | normal error (deg) | vertex error (edge lengths) | ridge F1 | subtle ridges labelled | angle at subtle "
        "ridges (deg) |\n| --- | --- | --- | --- | --- | --- |\n{}\n",
        number_, title, text, captions_, line, pictures_, rows_);
  }

 private:
  bool is_subtle(std::size_t edge) const {
    const double angle = std::abs(angles_[edge]) * kDegrees;
    return topology_.is_interior(edge) && angle > kSubtleFrom && angle < kSubtleTo;
  }
  double subtle_recall(const std::vector<double>& labels) const {
    double all = 0, labelled = 0;
    for (std::size_t e = 0; e < labels.size(); ++e) {
      if (!is_subtle(e)) continue;
      ++all;
      labelled += labels[e] >= kRidgeThreshold ? 1 : 0;
    }
    return all > 0 ? labelled / all : 0;
  }
  /// Mean dihedral angle over the subtle ridges of the original; near zero when they are smoothed away.
  double subtle_angle(const Mesh& mesh) const {
    const std::vector<double> now = signed_dihedral_angles(mesh, topology_, mesh.positions);
    double count = 0, sum = 0;
    for (std::size_t e = 0; e < now.size(); ++e) {
      if (!is_subtle(e)) continue;
      ++count;
      sum += now[e] * (angles_[e] > 0 ? 1 : -1) * kDegrees;
    }
    return count > 0 ? sum / count : 0;
  }

  int number_;
  Mesh original_, noisy_;
  Topology topology_;
  std::vector<double> angles_;
  View view_;
  std::filesystem::path directory_;
  std::string captions_, pictures_, rows_;
  int count_ = 0;
};

/// Debian's fandisk with Gaussian noise along the normals, as in the paper.
Figure fandisk(int number, const std::filesystem::path& directory) {
  const auto path = test::cgal_mesh("fandisk.off");
  if (!path) throw std::runtime_error("fandisk.off is missing: install libcgal-demo");
  const Mesh original = decode_mesh(test::read_file(*path), MeshFormat::kOff).mesh;
  return {number, original, add_noise(original, 0.2, 1, NoiseKind::kNormal), {-20, 35, {}}, directory};
}

/// Labels by the angle alone: 1 for edges that are sharper than the threshold of the options.
std::vector<double> sharp_edges(const Mesh& mesh, const Topology& topology, double threshold) {
  std::vector<double> labels = signed_dihedral_angles(mesh, topology, mesh.positions);
  for (double& label : labels) label = std::abs(label) > threshold ? 1 : 0;
  return labels;
}

void figure3(const std::filesystem::path& directory) {
  Figure figure = fandisk(3, directory);
  MrfOptions options;
  options.solver = Solver::kMetropolis;
  figure.add("noisy", "noisy, labelled by the dihedral angle alone",
             {figure.noisy(), sharp_edges(figure.noisy(), figure.topology(), options.sharpness_threshold)});
  figure.add("smooth", "smoothed, with its ridge labels", figure.smoothed(options));
  figure.write("ridge labels before and after",
               "Fandisk with noise of 0.2 edge lengths along the normals. Edges with a label of at least 0.5 are red.");
}

void figure4(const std::filesystem::path& directory) {
  Figure figure = fandisk(4, directory);
  figure.add("original", "original", {figure.original(), {}});
  figure.add("noisy", "noisy", {figure.noisy(), {}});
  figure.add("fuzzy-vector-median", "fuzzy vector median", {figure.smoothed(FuzzyVectorMedianOptions{}).mesh, {}});
  MrfOptions square_root;
  square_root.solver = Solver::kMetropolis;
  square_root.smoothness = Smoothness::kSquareRoot;
  square_root.edge_process = false;
  figure.add("square-root", "square-root potential, no labels", {figure.smoothed(square_root).mesh, {}});
  MrfOptions labels;
  labels.solver = Solver::kMetropolis;
  labels.sharpness_threshold = 28 / kDegrees;
  figure.add("quadratic", "quadratic potential with labels", figure.smoothed(labels));
  figure.write("feature-preserving methods",
               fmt::format("Subtle ridges are edges of {} to {} degrees in the original; sharpness_threshold_deg=28.",
                           kSubtleFrom, kSubtleTo));
}

void figure5(const std::filesystem::path& directory) {
  Figure figure = fandisk(5, directory);
  figure.add("noisy", "noisy", {figure.noisy(), {}});
  figure.add("all", "all ridges kept", figure.smoothed({}));
  MrfOptions convex;
  convex.solver = Solver::kMetropolis;
  convex.ridge_kind = RidgeKind::kConvex;
  const Result clamped = figure.smoothed(convex);
  figure.add("convex", "ridge_kind=convex", clamped);
  const auto mean_angle = [&](const Mesh& mesh, bool concave) {
    const std::vector<double> now = signed_dihedral_angles(mesh, figure.topology(), mesh.positions);
    double sum = 0, count = 0;
    for (std::size_t e = 0; e < now.size(); ++e) {
      if (std::abs(figure.angles()[e]) * kDegrees < 40 || (figure.angles()[e] < 0) != concave) continue;
      sum += std::abs(now[e]) * kDegrees;
      ++count;
    }
    return count > 0 ? sum / count : 0;
  };
  figure.write("curvature clamping",
               fmt::format("Ridges of more than 40 degrees in the original, mean angle in the original and in the two "
                           "results: concave {:.1f}, {:.1f}, clamped {:.1f}; convex {:.1f}, {:.1f}, {:.1f}.",
                           mean_angle(figure.original(), true), mean_angle(figure.smoothed({}).mesh, true),
                           mean_angle(clamped.mesh, true), mean_angle(figure.original(), false),
                           mean_angle(figure.smoothed({}).mesh, false), mean_angle(clamped.mesh, false)));
}

std::vector<Line> normal_field(const Mesh& mesh, double length) {
  std::vector<Line> lines;
  const Topology topology = build_topology(mesh);
  const std::vector<Vec3> normals = face_normals(mesh, topology, mesh.positions);
  for (std::size_t f = 0; f < normals.size(); ++f) {
    const auto [a, b, c] = mesh.triangles[f];
    const Vec3 center = (mesh.positions[a] + mesh.positions[b] + mesh.positions[c]) / 3;
    lines.push_back({center, center + length * normals[f], kNormalColor});
  }
  return lines;
}

void figure6(const std::filesystem::path& directory) {
  const Mesh cube = test::cube(12);
  Figure figure(6, cube, add_noise(cube, 0.2, 1, NoiseKind::kGaussian), {-25, 35, {}}, directory);
  MrfOptions options;
  options.solver = Solver::kMetropolis;
  options.process = Process::kFace;
  const double length = 0.05;
  figure.add("noisy", "noisy cube, its normals and its sharp edges",
             {figure.noisy(), sharp_edges(figure.noisy(), figure.topology(), options.sharpness_threshold)},
             normal_field(figure.noisy(), length));
  const Result result = figure.smoothed(options);
  figure.add("face", "face and edge process", result, normal_field(result.mesh, length));
  figure.write("a cube by the face and the edge process",
               "Gaussian noise of 0.2 edge lengths in all directions. Normals are blue, labelled edges red.");
}

/// Writes the page from the sections that exist.
void write_page(const std::filesystem::path& directory) {
  std::ofstream page(directory / "README.md");
  page << "# The paper's figures\n\nMade by `tests/quality/figures.sh [3] [4] [5] [6]`.\n\n";
  for (const int number : {3, 4, 5, 6}) {
    const auto section = directory / fmt::format("fig{}.md", number);
    if (std::filesystem::exists(section)) page << test::read_file(section);
  }
}

}  // namespace
}  // namespace crease::quality

int main(int argc, char** argv) {
  using namespace crease::quality;
  const std::map<std::string, void (*)(const std::filesystem::path&)> figures{
      {"3", figure3}, {"4", figure4}, {"5", figure5}, {"6", figure6}};
  if (argc < 3) {
    std::cerr << "usage: crease_figures DIRECTORY 3|4|5|6 ...\n";
    return 2;
  }
  try {
    const std::filesystem::path directory = argv[1];
    std::filesystem::create_directories(directory);
    for (int i = 2; i < argc; ++i) figures.at(argv[i])(directory);
    write_page(directory);
  } catch (const std::exception& error) {
    std::cerr << error.what() << '\n';
    return 1;
  }
}
