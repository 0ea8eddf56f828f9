#include "core/io/vertex_weights.h"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "core/base/text.h"
#include "core/error.h"
#include "core/io/text_cursor.h"

namespace crease {
namespace {

using nlohmann::json;

std::string item(std::size_t index) { return fmt::format("weights[{}]", index); }

[[noreturn]] void refuse(std::string field, std::string value, std::string expected, std::string place = {}) {
  throw Error::parameter(code::kWeightsInvalid, std::move(field), std::move(value), std::move(expected),
                         std::move(place));
}

std::string a_weight() { return fmt::format("a number from 0 to {}", kMaxWeight); }

/// The text around the byte, counted from 1, where the JSON stops being valid.
std::string_view word_at(std::string_view text, std::size_t byte) {
  constexpr std::string_view kEnds = "[], \t\r\n";
  const std::size_t at = std::min(byte, text.size());
  const std::size_t start = at < 2 ? 0 : text.find_last_of(kEnds, at - 2) + 1;
  const std::string_view rest = text.substr(start);
  return rest.substr(0, rest.find_first_of(kEnds));
}

/// Collects the numbers of one flat array. Refuses anything else as soon as it appears.
class WeightsReader final : public json::json_sax_t {
 public:
  WeightsReader(std::string_view text, std::size_t vertices) : text_(text), vertices_(vertices) {
    weights_.reserve(vertices);
  }

  std::vector<double> take() {
    if (weights_.size() < vertices_) refuse("weights", fmt::format("{} numbers", weights_.size()), one_per_vertex());
    return std::move(weights_);
  }

  bool null() override { return odd("null"); }
  bool boolean(bool value) override { return odd(value ? "true" : "false"); }
  bool number_integer(number_integer_t value) override { return add(static_cast<double>(value)); }
  bool number_unsigned(number_unsigned_t value) override { return add(static_cast<double>(value)); }
  bool number_float(number_float_t value, const string_t& /*text*/) override { return add(value); }
  bool string(string_t& value) override { return odd(printable(value)); }
  bool binary(binary_t& /*value*/) override { return odd("binary"); }
  bool start_object(std::size_t /*size*/) override { return odd("an object"); }
  bool key(string_t& /*name*/) override { return true; }
  bool end_object() override { return true; }
  bool start_array(std::size_t /*size*/) override { return inside_ ? odd("an array") : (inside_ = true); }
  bool end_array() override {
    inside_ = false;
    return true;
  }
  bool parse_error(std::size_t byte, const std::string& /*token*/, const json::exception& /*fault*/) override {
    refuse(inside_ ? item(weights_.size()) : "weights", printable(word_at(text_, byte)),
           inside_ ? a_weight() : one_per_vertex(), fmt::format("byte {}", byte));
  }

 private:
  bool add(double weight) {
    if (!inside_) refuse("weights", "a number", one_per_vertex());
    if (weights_.size() == vertices_) refuse(item(vertices_), fmt::format("{}", weight), one_per_vertex());
    if (!is_weight(weight)) fail_weight(weights_.size(), weight);
    weights_.push_back(weight);
    return true;
  }

  [[noreturn]] bool odd(std::string value) const {
    if (!inside_) refuse("weights", std::move(value), one_per_vertex());
    refuse(item(weights_.size()), std::move(value), a_weight());
  }

  std::string one_per_vertex() const { return fmt::format("an array of {} numbers, one per vertex", vertices_); }

  std::string_view text_;
  std::size_t vertices_;
  std::vector<double> weights_;
  bool inside_ = false;
};

}  // namespace

void fail_weight(std::size_t vertex, double weight, std::string place) {
  refuse(item(vertex), fmt::format("{}", weight), a_weight(), std::move(place));
}

std::vector<double> read_weights(std::string_view text, std::size_t vertices) {
  WeightsReader reader(text, vertices);
  json::sax_parse(text.begin(), text.end(), &reader);
  return reader.take();
}

}  // namespace crease
