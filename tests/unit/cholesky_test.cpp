#include "core/graduated/cholesky.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <cmath>
#include <map>
#include <set>
#include <string>
#include <utility>

namespace crease {
namespace {

using Links = std::set<std::pair<int, int>>;  ///< of a graph, the larger end first

/// The lower triangle of the Laplacian of a graph with irregular weights, plus `diagonal`.
LowerTriangle laplacian(int count, const Links& links, double diagonal) {
  std::vector<Eigen::Triplet<double>> entries;
  for (int v = 0; v < count; ++v) entries.emplace_back(v, v, diagonal);
  for (const auto& [i, j] : links) {
    const double weight = std::exp(3 * std::sin(7.0 * i + j));
    entries.emplace_back(i, j, -weight);
    entries.emplace_back(i, i, weight);
    entries.emplace_back(j, j, weight);
  }
  LowerTriangle lower(count, count);
  lower.setFromTriplets(entries.begin(), entries.end());
  return lower;
}

/// Each vertex of a grid is linked to those up to two steps away.
Links grid(int width, int height, int offset = 0) {
  Links links;
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      for (int dy = 0; dy <= 2; ++dy) {
        for (int dx = -2; dx <= 2; ++dx) {
          if ((dy == 0 && dx <= 0) || x + dx < 0 || x + dx >= width || y + dy >= height) continue;
          links.emplace(offset + (y + dy) * width + x + dx, offset + y * width + x);
        }
      }
    }
  }
  return links;
}

struct Graph {
  int count = 0;
  Links links;
};

std::map<std::string, Graph> graphs() {
  std::map<std::string, Graph> all;
  all["one"] = {1, {}};
  all["without links"] = {9, {}};
  all["grid"] = {23 * 17, grid(23, 17)};
  all["two parts"] = {500, grid(20, 12)};
  all["two parts"].links.merge(grid(10, 26, 240));
  all["long"] = {400, grid(2, 200)};
  for (int v = 1; v < 60; ++v) all["star"].links.emplace(v, 0);
  all["star"].count = 60;
  for (int i = 0; i < 40; ++i) {
    for (int j = 0; j < i; ++j) all["complete"].links.emplace(i, j);
  }
  all["complete"].count = 40;
  return all;
}

std::vector<HalfLanes> sides(int count) {
  std::vector<HalfLanes> result;
  for (int i = 0; i < count; ++i) {
    const auto x = static_cast<float>(i);
    result.push_back(HalfLanes{std::sin(x), std::cos(3 * x), 1, i == count / 2 ? 1.0F : 0.0F});
  }
  return result;
}

TEST(SparseCholesky, SolvesAsADenseFactorisationDoes) {
  ThreadTeam team(2);
  for (const auto& [name, graph] : graphs()) {
    const LowerTriangle lower = laplacian(graph.count, graph.links, 0.5);
    SparseCholesky factors(lower);
    factors.factorize(lower, team);
    const std::vector<HalfLanes> right = sides(graph.count);
    std::vector<HalfLanes> solved = right;
    factors.solve(solved, team);
    const Eigen::MatrixXd dense = Eigen::MatrixXd(lower).selfadjointView<Eigen::Lower>();
    const Eigen::LLT<Eigen::MatrixXd> exact(dense);
    for (std::size_t k = 0; k < 4; ++k) {
      Eigen::VectorXd b(graph.count), x(graph.count);
      for (int i = 0; i < graph.count; ++i) {
        b[i] = static_cast<double>(right[static_cast<std::size_t>(i)][k]);
        x[i] = static_cast<double>(solved[static_cast<std::size_t>(i)][k]);
      }
      EXPECT_LE((x - exact.solve(b)).norm(), 1e-4 * exact.solve(b).norm()) << name << " " << k;
    }
  }
}

TEST(SparseCholesky, FactorisesAgainWithOtherValues) {
  ThreadTeam team(1);
  const Graph graph = graphs().at("grid");
  const LowerTriangle first = laplacian(graph.count, graph.links, 0.5);
  SparseCholesky factors(first);
  factors.factorize(first, team);
  const LowerTriangle doubled = 2 * first;
  std::vector<HalfLanes> of_first = sides(graph.count), of_doubled = of_first;
  factors.solve(of_first, team);
  factors.factorize(doubled, team);
  factors.solve(of_doubled, team);
  for (std::size_t i = 0; i < of_first.size(); ++i) {
    for (std::size_t k = 0; k < 4; ++k) EXPECT_NEAR(of_doubled[i][k], of_first[i][k] / 2, 1e-5);
  }
}

TEST(SparseCholesky, GivesTheSameBitsForAnyNumberOfThreads) {
  const Graph graph{60 * 60, grid(60, 60)};
  const LowerTriangle lower = laplacian(graph.count, graph.links, 0.01);
  std::vector<std::vector<HalfLanes>> results;
  for (const std::uint32_t threads : {1U, 2U, 5U}) {
    ThreadTeam team(threads);
    SparseCholesky factors(lower);
    factors.factorize(lower, team);
    results.push_back(sides(graph.count));
    factors.solve(results.back(), team);
  }
  for (std::size_t i = 0; i < results[0].size(); ++i) {
    for (std::size_t k = 0; k < 4; ++k) {
      EXPECT_EQ(results[0][i][k], results[1][i][k]);
      EXPECT_EQ(results[0][i][k], results[2][i][k]);
    }
  }
}

/// A Laplacian without anything on its diagonal is singular; rounding decides what its last pivots are.
TEST(SparseCholesky, StaysFiniteWhereRoundingEatsAPivot) {
  ThreadTeam team(1);
  const Graph graph = graphs().at("grid");
  for (const double diagonal : {0.0, -1e-9, 1e-12}) {
    const LowerTriangle lower = laplacian(graph.count, graph.links, diagonal);
    SparseCholesky factors(lower);
    factors.factorize(lower, team);
    std::vector<HalfLanes> solved = sides(graph.count);
    factors.solve(solved, team);
    for (const HalfLanes& side : solved) EXPECT_TRUE(std::isfinite(side[0] + side[1] + side[2] + side[3])) << diagonal;
  }
}

}  // namespace
}  // namespace crease
