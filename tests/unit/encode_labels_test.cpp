#include <gtest/gtest.h>

#include <cmath>
#include <sstream>

#include "core/io/encode.h"
#include "tests/support/labelled_meshes.h"
#include "tests/support/meshes.h"

namespace crease {
namespace {

LabelledMesh spread_labels() {
  LabelledMesh result = test::labelled(test::cad_part(1).mesh);
  const auto count = static_cast<double>(result.labels.size());
  for (std::size_t e = 0; e < result.labels.size(); ++e) result.labels[e] = static_cast<double>(e) / (count - 1);
  return result;
}

struct Row {
  Edge edge;
  double label = 0, degrees = 0;
};

std::vector<Row> rows_of_json(const std::string& text) {
  const auto json = nlohmann::json::parse(text);
  std::vector<Row> rows;
  for (std::size_t i = 0; i < json["edges"].size(); ++i) {
    rows.push_back({{json["edges"][i][0], json["edges"][i][1]}, json["labels"][i], json["dihedral_deg"][i]});
  }
  EXPECT_EQ(json["count"], rows.size());
  EXPECT_EQ(json["labels"].size(), rows.size());
  EXPECT_EQ(json["dihedral_deg"].size(), rows.size());
  return rows;
}

std::vector<Row> rows_of_csv(const std::string& text) {
  std::istringstream lines(text);
  std::string line;
  std::getline(lines, line);
  EXPECT_EQ(line, "v0,v1,label,dihedral_deg");
  std::vector<Row> rows;
  while (std::getline(lines, line)) {
    std::istringstream cells(line);
    Row row;
    char comma = 0;
    cells >> row.edge.v0 >> comma >> row.edge.v1 >> comma >> row.label >> comma >> row.degrees;
    EXPECT_TRUE(cells && cells.eof()) << line;
    rows.push_back(row);
  }
  return rows;
}

TEST(EncodeLabels, EveryEdgeIsListedWithItsLabelAndAngle) {
  const LabelledMesh result = spread_labels();
  for (const auto& rows : {rows_of_json(write_labels_json(result)), rows_of_csv(write_labels_csv(result))}) {
    ASSERT_EQ(rows.size(), result.edges.size());
    for (std::size_t e = 0; e < rows.size(); ++e) {
      EXPECT_EQ(rows[e].edge, result.edges[e]);
      EXPECT_NEAR(rows[e].label, result.labels[e], 5e-6 * result.labels[e]);
      EXPECT_NEAR(rows[e].degrees, result.dihedral_rad[e] * 180 / M_PI, 5e-4);
      EXPECT_TRUE(rows[e].label >= 0 && rows[e].label <= 1);
    }
  }
}

TEST(EncodeLabels, AMinimumDropsLowerLabelsAndKeepsTheOrder) {
  const LabelledMesh result = spread_labels();
  for (const double min : {0.0, 0.3, 0.5, 1.0}) {
    std::vector<Edge> expected;
    for (std::size_t e = 0; e < result.edges.size(); ++e) {
      if (result.labels[e] >= min) expected.push_back(result.edges[e]);
    }
    const std::string json = write_labels_json(result, min);
    EXPECT_EQ(nlohmann::json::parse(json)["threshold"], min);
    for (const auto& rows : {rows_of_json(json), rows_of_csv(write_labels_csv(result, min))}) {
      std::vector<Edge> listed;
      for (const Row& row : rows) listed.push_back(row.edge);
      EXPECT_EQ(listed, expected);
    }
  }
}

TEST(EncodeLabels, AnEmptyListIsAValidDocument) {
  const LabelledMesh result = test::labelled(test::grid(2, 2));
  EXPECT_TRUE(rows_of_json(write_labels_json(result, 0.5)).empty());
  EXPECT_TRUE(rows_of_csv(write_labels_csv(result, 0.5)).empty());
}

TEST(EncodeLabels, RoundingDoesNotCreateRidges) {
  LabelledMesh result = test::labelled(test::grid(1, 1));
  result.labels = {std::nextafter(0.5, 0.0), 0.5, 0.49999996, 0.499999, 1.0};
  ASSERT_EQ(result.edges.size(), result.labels.size());
  for (const auto& rows : {rows_of_json(write_labels_json(result)), rows_of_csv(write_labels_csv(result))}) {
    for (std::size_t e = 0; e < rows.size(); ++e) {
      EXPECT_EQ(rows[e].label >= kRidgeThreshold, result.labels[e] >= kRidgeThreshold) << rows[e].label;
    }
  }
}

TEST(EncodeLabels, NumbersAreCompact) {
  LabelledMesh result = test::labelled(test::grid(1, 1));
  result.labels.assign(5, 1.0 / 3);
  result.dihedral_rad.assign(5, -1.0 / 3);
  EXPECT_NE(write_labels_csv(result).find(",0.333333,-19.0986\n"), std::string::npos);
}

}  // namespace
}  // namespace crease
