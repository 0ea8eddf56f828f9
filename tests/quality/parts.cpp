#include "tests/quality/parts.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <functional>
#include <vector>

#include "core/base/random.h"
#include "tests/support/patch_builder.h"

namespace crease::quality {
namespace {

using test::PatchBuilder;
using Point = Eigen::Vector2d;

constexpr double kTurn = 2 * M_PI;

int cells_for(double length, double cells_per_unit) {
  return std::max(1, static_cast<int>(std::lround(length * cells_per_unit)));
}

/// A stretch of a plane curve over [0, 1], cut into cells.
struct Stretch {
  std::function<Point(double)> point;
  int cells = 1;
  bool goes_on = false;  ///< smoothly from the stretch before
};

Stretch line(const Point& from, const Point& to, int cells) {
  return {[=](double t) -> Point { return from + t * (to - from); }, cells};
}

Stretch line(const Point& from, const Point& to, const Sampling& sampling) {
  return line(from, to, cells_for((to - from).norm(), sampling.cells));
}

/// From one angle to another, in radians against the clock.
Stretch arc(const Point& centre, double radius, double from, double to, int cells) {
  return {[=](double t) -> Point {
            const double angle = from + t * (to - from);
            return centre + radius * Point(std::cos(angle), std::sin(angle));
          },
          cells};
}

Stretch smoothly(Stretch stretch) {
  stretch.goes_on = true;
  return stretch;
}

/// Stretches one after the other, with lattice points at whole numbers from 0 to cells().
class Profile {
 public:
  Profile(std::vector<Stretch> stretches, double grading) : stretches_(std::move(stretches)), grading_(grading) {
    for (const Stretch& stretch : stretches_) starts_.push_back(starts_.back() + stretch.cells);
  }

  int cells() const { return starts_.back(); }
  std::size_t stretches() const { return stretches_.size(); }
  int start(std::size_t stretch) const { return starts_[stretch]; }
  bool starts_surface(std::size_t stretch) const { return !stretches_[stretch].goes_on; }

  /// Whether surfaces meet here.
  bool is_corner(int place) const {
    if (place == 0 || place == cells()) return true;
    const auto found = std::ranges::find(starts_, place);
    return found != starts_.end() && starts_surface(static_cast<std::size_t>(found - starts_.begin()));
  }

  Point at(double place) const {
    std::size_t k = 0;
    while (k + 1 < stretches_.size() && place >= starts_[k + 1]) ++k;
    return stretches_[k].point(graded((place - starts_[k]) / stretches_[k].cells));
  }

 private:
  /// Cells that grow by a constant factor.
  double graded(double share) const {
    if (grading_ == 1) return share;
    return (std::pow(grading_, share) - 1) / (grading_ - 1);
  }

  std::vector<Stretch> stretches_;
  std::vector<int> starts_{0};
  double grading_;
};

/// Random displacements of lattice points, always the same for a point of a patch.
class Jitter {
 public:
  explicit Jitter(double amount) : amount_(amount) {}

  void next_patch() { ++patch_; }
  Point operator()(int u, int v) const {
    if (amount_ == 0) return Point::Zero();
    const auto site = static_cast<std::uint32_t>(u * 0x8000 + v);
    const auto words = CounterRandom(1, RandomStream::kNoise)(patch_, site);
    return amount_ * Point(CounterRandom::symmetric(words[0]), CounterRandom::symmetric(words[1]));
  }

 private:
  double amount_;
  std::uint32_t patch_ = 0;
};

/// Lattice patches with jitter inside.
class PartBuilder {
 public:
  explicit PartBuilder(const Sampling& sampling) : jitter_(sampling.jitter) {}

  PatchBuilder& patches() { return builder_; }

  /// A patch over [0, columns] × [0, rows]; its border keeps its places.
  void patch(int columns, int rows, const std::function<Vec3(double, double)>& point) {
    jitter_.next_patch();
    builder_.patch(columns, rows, [&](int u, int v) {
      const bool inside = u > 0 && u < columns && v > 0 && v < rows;
      const Point shift = inside ? jitter_(u, v) : Point::Zero();
      return point(u + shift.x(), v + shift.y());
    });
  }

  /// Patches along a profile, with a new surface where it has a corner.
  void along(const Profile& profile, int rows, const std::function<Vec3(double, double)>& point) {
    for (std::size_t k = 0; k < profile.stretches(); ++k) {
      if (profile.starts_surface(k)) builder_.next_surface();
      const int start = profile.start(k);
      patch(profile.start(k + 1) - start, rows, [&](double u, double v) { return point(start + u, v); });
    }
  }

  CadPart part() const { return {builder_.mesh(), builder_.surface_borders()}; }

 private:
  PatchBuilder builder_;
  Jitter jitter_;
};

/// The strip between two profiles in x and z, extruded along y. Seen along y the lower one has the strip on its left.
CadPart extrude(const Profile& lower, const Profile& upper, int layers, double depth, const Sampling& sampling) {
  PartBuilder builder(sampling);
  const int along = lower.cells();
  const int across = cells_for(depth, sampling.cells / sampling.aspect);
  const auto at = [&](const Profile& profile, double u, double y) {
    const Point p = profile.at(u);
    return Vec3(p.x(), y, p.y());
  };
  const auto between = [&](double u, double v, double y) -> Vec3 {
    return (1 - v / layers) * at(lower, u, y) + v / layers * at(upper, u, y);
  };
  builder.along(upper, across, [&](double u, double v) { return at(upper, u, depth * v / across); });
  builder.along(lower, across, [&](double u, double v) { return at(lower, u, depth * (1 - v / across)); });
  for (const double y : {0.0, depth}) {
    if (!sampling.closed) break;
    builder.patches().next_surface();
    builder.patch(along, layers, [&](double u, double v) { return between(y == 0 ? u : along - u, v, y); });
  }
  for (const int end : {0, along}) {
    builder.patches().next_surface();
    builder.patch(across, layers, [&](double u, double v) {
      return between(end, v, depth * (end == 0 ? 1 - u / across : u / across));
    });
  }
  return builder.part();
}

/// A profile of radius and height, turned about the z axis. It has the axis on its left, and begins and ends with a
/// flat disc.
CadPart turn(const Profile& profile, int around, const Sampling& sampling) {
  PartBuilder builder(sampling);
  PatchBuilder& patches = builder.patches();
  for (std::size_t k = 0; k < profile.stretches(); ++k) {
    if (profile.starts_surface(k)) patches.next_surface();
    const int start = profile.start(k);
    builder.patch(around, profile.start(k + 1) - start, [&](double u, double v) {
      const Point p = profile.at(start + v);
      const double angle = u == around ? 0 : kTurn * u / around;
      return Vec3(p.x() * std::cos(angle), p.x() * std::sin(angle), p.y());
    });
  }
  for (const int end : {0, profile.cells()}) {
    if (!sampling.closed) break;
    const Point p = profile.at(end);
    patches.next_surface();
    patches.disc({0, 0, p.y()}, p.x(), around, end > 0);
  }
  return builder.part();
}

/// A disc with a flat bottom and a given height over the share of the radius, 0 at the rim.
void add_nose(PatchBuilder& patches, int around, double radius, double z, const std::function<double(double)>& height) {
  patches.next_surface();
  patches.disc(around, true, [&](const Vec3& point) -> Vec3 {
    const double share = std::min(1.0, point.norm());
    return radius * point + Vec3(0, 0, z + (share > 1 - 1e-9 ? 0 : height(share)));
  });
}

int cells_around(double radius, const Sampling& sampling) { return cells_for(kTurn * radius, sampling.cells); }

/// The i-th of 8·half points on the border of a square with sides of 2, against the clock from angle 0.
Vec3 on_unit_square(int i, int half) {
  const int side = ((i + half) / (2 * half)) % 4;
  const double along = static_cast<double>((i + half) % (2 * half) - half) / half;
  return Eigen::AngleAxisd(side * M_PI / 2, Vec3::UnitZ()) * Vec3(1, along, 0);
}

}  // namespace

CadPart cut_box(const Sampling& sampling) {
  constexpr double kLength = 4, kHeight = 1.6, kDepth = 2, kRadius = 1, kFrom = 1, kTo = 3;
  const double half_angle = std::asin((kTo - kFrom) / 2 / kRadius * 0.9);
  const double half_width = kRadius * std::sin(half_angle), middle = (kFrom + kTo) / 2;
  const Point centre(middle, kHeight + kRadius * std::cos(half_angle));
  const int cut = cells_for(2 * kRadius * half_angle, sampling.cells);
  const Point left(middle - half_width, kHeight), right(middle + half_width, kHeight);
  const Stretch first = line({0, kHeight}, left, sampling), last = line(right, {kLength, kHeight}, sampling);
  const Profile upper({first, arc(centre, kRadius, -M_PI / 2 - half_angle, -M_PI / 2 + half_angle, cut), last},
                      sampling.grading);
  const Profile lower({line({0, 0}, {left.x(), 0}, first.cells), smoothly(line({left.x(), 0}, {right.x(), 0}, cut)),
                       smoothly(line({right.x(), 0}, {kLength, 0}, last.cells))},
                      sampling.grading);
  return extrude(lower, upper, cells_for(kHeight * 0.7, sampling.cells), kDepth, sampling);
}

CadPart bracket(const Sampling& sampling) {
  constexpr double kLength = 3, kThickness = 0.6, kRadius = 0.7, kDepth = 2;
  const int half = cells_for(kLength, sampling.cells);
  const double straight = kLength - kThickness - kRadius;
  const int plate = static_cast<int>(std::lround(half * straight / (straight + kRadius * M_PI / 4)));
  const Point centre(kThickness + kRadius, kThickness + kRadius);
  const Profile lower({line({0, kLength}, {0, 0}, half), line({0, 0}, {kLength, 0}, half)}, sampling.grading);
  const Profile upper({line({kThickness, kLength}, {kThickness, centre.y()}, plate),
                       smoothly(arc(centre, kRadius, M_PI, 1.5 * M_PI, 2 * (half - plate))),
                       smoothly(line({centre.x(), kThickness}, {kLength, kThickness}, plate))},
                      sampling.grading);
  return extrude(lower, upper, cells_for(kThickness, sampling.cells), kDepth, sampling);
}

CadPart channel(const Sampling& sampling) {
  constexpr double kHeight = 1.5, kFloor = 0.6, kDepth = 2.5;
  const std::vector<Point> top{{0, kHeight},  {0.8, kHeight}, {1.3, kFloor},
                               {2.1, kFloor}, {2.6, kHeight}, {3.4, kHeight}};
  std::vector<Stretch> upper, lower;
  for (std::size_t k = 1; k < top.size(); ++k) {
    upper.push_back(line(top[k - 1], top[k], sampling));
    lower.push_back(smoothly(line({top[k - 1].x(), 0}, {top[k].x(), 0}, upper.back().cells)));
  }
  lower.front().goes_on = false;
  return extrude({lower, sampling.grading}, {upper, sampling.grading}, cells_for(kHeight * 0.7, sampling.cells), kDepth,
                 sampling);
}

CadPart shaft(const Sampling& sampling) {
  const std::vector<Point> corners{{0.8, 0}, {0.8, 1.2}, {1.2, 1.2}, {1.2, 2.2}, {0.5, 2.2}, {0.5, 4}};
  std::vector<Stretch> stretches;
  const Sampling along{.cells = sampling.cells / sampling.aspect};
  for (std::size_t k = 1; k < corners.size(); ++k) stretches.push_back(line(corners[k - 1], corners[k], along));
  return turn({stretches, sampling.grading}, cells_around(0.8, sampling), sampling);
}

CadPart spindle(const Sampling& sampling) {
  const std::vector<Point> corners{{1, 0}, {1, 0.8}, {0.5, 2.2}, {0.5, 2.8}, {0.9, 2.8}, {0.9, 3.3}};
  std::vector<Stretch> stretches;
  const Sampling along{.cells = sampling.cells / sampling.aspect};
  for (std::size_t k = 1; k < corners.size(); ++k) stretches.push_back(line(corners[k - 1], corners[k], along));
  // The cone meets the cylinder below at 19.7° and the neck above likewise: too flat for ridges.
  stretches[1].goes_on = stretches[2].goes_on = true;
  return turn({stretches, sampling.grading}, cells_around(0.8, sampling), sampling);
}

CadPart cone(const Sampling& sampling) {
  constexpr double kRadius = 1.2, kHeight = 2;
  const int around = cells_around(kRadius, sampling);
  PatchBuilder patches;
  add_nose(patches, around, kRadius, 0, [](double share) { return kHeight * (1 - share); });
  patches.next_surface();
  if (sampling.closed) patches.disc({0, 0, 0}, kRadius, around, false);
  return {patches.mesh(), patches.surface_borders()};
}

CadPart bullet(const Sampling& sampling) {
  constexpr double kRadius = 1, kLength = 1.5, kNose = 0.8;
  const int around = cells_around(kRadius, sampling);
  PartBuilder builder(sampling);
  const int rows = cells_for(kLength, sampling.cells / sampling.aspect);
  builder.patch(around, rows, [&](double u, double v) {
    const double angle = u == around ? 0 : kTurn * u / around;
    return Vec3(kRadius * std::cos(angle), kRadius * std::sin(angle), kLength * v / rows);
  });
  add_nose(builder.patches(), around, kRadius, kLength, [](double share) { return kNose * (1 - share * share); });
  builder.patches().next_surface();
  if (sampling.closed) builder.patches().disc({0, 0, 0}, kRadius, around, false);
  return builder.part();
}

CadPart elbow(const Sampling& sampling) {
  constexpr double kSide = 2, kPipe = 0.6, kBend = 1.4;
  const int half = cells_for(kSide / 4, sampling.cells) * 2 / 2, n = 2 * half, around = 8 * half;
  PartBuilder builder(sampling);
  const auto side = [&](const Vec3& corner, const Vec3& right, const Vec3& up) {
    builder.patches().next_surface();
    builder.patch(n, n,
                  [&](double u, double v) -> Vec3 { return corner + u / n * kSide * right + v / n * kSide * up; });
  };
  const double a = kSide / 2;
  const Vec3 x = Vec3::UnitX(), y = Vec3::UnitY(), z = Vec3::UnitZ();
  side({-a, -a, 0}, x, z);
  side({a, -a, 0}, y, z);
  side({a, a, 0}, -x, z);
  side({-a, a, 0}, -y, z);
  side({-a, a, 0}, x, -y);
  builder.patches().next_surface();
  const int rings = std::max(1, half / 2);
  builder.patches().patch(around, rings, [&](int u, int v) -> Vec3 {
    const double share = static_cast<double>(v) / rings;
    return (1 - share) * a * on_unit_square(u % around, half) +
           share * PatchBuilder::on_circle({0, 0, 0}, kPipe, u, around) + kSide * z;
  });
  const auto in_pipe = [&](const Vec3& local, double bend) -> Vec3 {
    const Vec3 axis(kBend * (1 - std::cos(bend)), 0, kSide + kBend * std::sin(bend));
    return axis + local.x() * Vec3(std::cos(bend), 0, -std::sin(bend)) + local.y() * y;
  };
  const int rows = cells_for(kBend * M_PI / 2, around / (kTurn * kPipe) / sampling.aspect);
  builder.patches().next_surface();
  builder.patch(around, rows, [&](double u, double v) {
    const double angle = u == around ? 0 : kTurn * u / around;
    return in_pipe(kPipe * Vec3(std::cos(angle), std::sin(angle), 0), M_PI / 2 * v / rows);
  });
  builder.patches().next_surface();
  if (sampling.closed) {
    builder.patches().disc(around, true, [&](const Vec3& point) { return in_pipe(kPipe * point, M_PI / 2); });
  }
  return builder.part();
}

CadPart prism(int sides, int columns_per_side, int rows) {
  const int around = sides * columns_per_side;
  const auto corner = [&](int k) { return PatchBuilder::on_circle({0, 0, 0}, 1, k, sides); };
  const auto flat = [&](const Vec3& point) -> Vec3 {
    const double turns = std::fmod(std::atan2(point.y(), point.x()) / kTurn + 1 + 1e-12, 1) * sides;
    const int k = static_cast<int>(turns);
    const double share = turns - k;
    return point.norm() * ((1 - share) * corner(k) + share * corner(k + 1));
  };
  const double height = rows * kTurn / around;
  PatchBuilder patches;
  patches.patch(around, rows, [&](int u, int v) -> Vec3 {
    return flat(PatchBuilder::on_circle({0, 0, 0}, 1, u, around)) + Vec3(0, 0, height * v / rows);
  });
  for (const bool up : {false, true}) {
    patches.next_surface();
    patches.disc(around, up, [&](const Vec3& point) -> Vec3 { return flat(point) + Vec3(0, 0, up ? height : 0); });
  }
  return {patches.mesh(), patches.surface_borders()};
}

}  // namespace crease::quality
