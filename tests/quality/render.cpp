#include "tests/quality/render.h"

#include <png.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <stdexcept>

namespace crease::quality {
namespace {

constexpr int kSamples = 3;  // per pixel and axis
constexpr double kLineWidth = 2.2;
constexpr double kMargin = 0.04;

/// Projects from the mesh to the picture: x and y in samples, z towards the viewer in the same unit.
class Camera {
 public:
  Camera(const View& view, int samples) {
    constexpr double kDegree = std::numbers::pi / 180;
    turn_ = (Eigen::AngleAxisd(view.turn_x * kDegree, Vec3::UnitX()) *
             Eigen::AngleAxisd(view.turn_y * kDegree, Vec3::UnitY()))
                .toRotationMatrix();
    Vec3 low = Vec3::Constant(std::numeric_limits<double>::infinity()), high = -low;
    for (const Vec3& point : view.box) {
      low = low.cwiseMin(turn_ * point);
      high = high.cwiseMax(turn_ * point);
    }
    center_ = (low + high) / 2;
    scale_ = (1 - 2 * kMargin) * samples / std::max(high.x() - low.x(), high.y() - low.y());
    middle_ = samples / 2.0;
  }

  Vec3 project(const Vec3& point) const {
    const Vec3 seen = scale_ * (turn_ * point - center_);
    return {middle_ + seen.x(), middle_ - seen.y(), seen.z()};
  }
  Vec3 turned(const Vec3& direction) const { return turn_ * direction; }

 private:
  Eigen::Matrix3d turn_;
  Vec3 center_;
  double scale_ = 1, middle_ = 0;
};

class Canvas {
 public:
  explicit Canvas(int size)
      : size_(size),
        colors_(static_cast<std::size_t>(size * size), Color{1, 1, 1}),
        depths_(colors_.size(), -std::numeric_limits<double>::infinity()) {}

  void fill(const Vec3& a, const Vec3& b, const Vec3& c, const Color& color) {
    const double area = (b.x() - a.x()) * (c.y() - a.y()) - (c.x() - a.x()) * (b.y() - a.y());
    if (std::abs(area) < 1e-12) return;
    visit({std::min({a.x(), b.x(), c.x()}), std::min({a.y(), b.y(), c.y()})},
          {std::max({a.x(), b.x(), c.x()}), std::max({a.y(), b.y(), c.y()})}, [&](double x, double y, std::size_t at) {
            const double u = ((b.x() - x) * (c.y() - y) - (c.x() - x) * (b.y() - y)) / area;
            const double v = ((c.x() - x) * (a.y() - y) - (a.x() - x) * (c.y() - y)) / area;
            const double w = 1 - u - v;
            const double depth = u * a.z() + v * b.z() + w * c.z();
            if (u < 0 || v < 0 || w < 0 || depth <= depths_[at]) return;
            depths_[at] = depth;
            colors_[at] = color;
          });
  }

  /// Draws a line slightly in front of its position.
  void stroke(const Vec3& from, const Vec3& to, double width, double lift, const Color& color) {
    const Eigen::Vector2d along(to.x() - from.x(), to.y() - from.y());
    const double square = along.squaredNorm();
    visit({std::min(from.x(), to.x()) - width, std::min(from.y(), to.y()) - width},
          {std::max(from.x(), to.x()) + width, std::max(from.y(), to.y()) + width},
          [&](double x, double y, std::size_t at) {
            const Eigen::Vector2d here(x - from.x(), y - from.y());
            const double t = square > 0 ? std::clamp(here.dot(along) / square, 0.0, 1.0) : 0;
            const double depth = from.z() + t * (to.z() - from.z()) + lift;
            if ((here - t * along).norm() > width / 2 || depth <= depths_[at]) return;
            colors_[at] = color;
          });
  }

  std::vector<png_byte> pixels(int samples) const {
    std::vector<png_byte> bytes;
    for (int row = 0; row < size_; row += samples) {
      for (int column = 0; column < size_; column += samples) {
        for (std::size_t channel = 0; channel < 3; ++channel) {
          float sum = 0;
          for (int k = 0; k < samples * samples; ++k) {
            const int pixel = (row + k / samples) * size_ + column + k % samples;
            sum += colors_[static_cast<std::size_t>(pixel)][channel];
          }
          bytes.push_back(static_cast<png_byte>(std::lround(255 * sum / static_cast<float>(samples * samples))));
        }
      }
    }
    return bytes;
  }

 private:
  template <typename Visit>
  void visit(const Eigen::Vector2d& low, const Eigen::Vector2d& high, Visit visit) const {
    const auto first = [](double x) { return std::max(0, static_cast<int>(std::floor(x))); };
    const auto last = [&](double x) { return std::min(size_ - 1, static_cast<int>(std::ceil(x))); };
    for (int row = first(low.y()); row <= last(high.y()); ++row) {
      for (int column = first(low.x()); column <= last(high.x()); ++column) {
        const int pixel = row * size_ + column;
        visit(column + 0.5, row + 0.5, static_cast<std::size_t>(pixel));
      }
    }
  }

  int size_;
  std::vector<Color> colors_;
  std::vector<double> depths_;
};

Color shade(const Vec3& normal) {
  const Vec3 light = Vec3(-0.4, 0.6, 0.7).normalized();
  const auto brightness = static_cast<float>(0.3 + 0.65 * std::max(0.0, std::abs(normal.dot(light))));
  return {brightness, brightness, brightness};
}

std::vector<png_byte> draw(const Panel& panel, const View& view, int size) {
  const Camera camera(view, size * kSamples);
  Canvas canvas(size * kSamples);
  for (const auto& [a, b, c] : panel.mesh.triangles) {
    const Vec3 &pa = panel.mesh.positions[a], &pb = panel.mesh.positions[b], &pc = panel.mesh.positions[c];
    canvas.fill(camera.project(pa), camera.project(pb), camera.project(pc),
                shade(camera.turned((pb - pa).cross(pc - pa).stableNormalized())));
  }
  for (const Line& line : panel.lines) {
    canvas.stroke(camera.project(line.from), camera.project(line.to), kLineWidth * kSamples, 3.0 * kSamples,
                  line.color);
  }
  return canvas.pixels(kSamples);
}

}  // namespace

void render_row(const std::vector<Panel>& panels, const View& view, int size, const std::filesystem::path& png) {
  const auto row_bytes = static_cast<std::ptrdiff_t>(3 * size);
  std::vector<std::vector<png_byte>> pictures;
  for (const Panel& panel : panels) pictures.push_back(draw(panel, view, size));
  std::vector<png_byte> bytes;
  for (std::ptrdiff_t row = 0; row < size; ++row) {
    for (const auto& picture : pictures) {
      const auto start = picture.begin() + row * row_bytes;
      bytes.insert(bytes.end(), start, start + row_bytes);
    }
  }
  png_image image{};
  image.version = PNG_IMAGE_VERSION;
  image.width = static_cast<png_uint_32>(size) * static_cast<png_uint_32>(panels.size());
  image.height = static_cast<png_uint_32>(size);
  image.format = PNG_FORMAT_RGB;
  if (png_image_write_to_file(&image, png.c_str(), 0, bytes.data(), 0, nullptr) == 0) {
    throw std::runtime_error(png.string() + ": " + image.message);
  }
}

void render(const Mesh& mesh, const std::vector<Line>& lines, const View& view, int size,
            const std::filesystem::path& png) {
  render_row({{mesh, lines}}, view, size, png);
}

}  // namespace crease::quality
