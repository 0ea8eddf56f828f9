#pragma once

#include <cstdint>
#include <cstring>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace crease {

/// A checkpoint that does not belong to this run, or is damaged.
class CheckpointError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// The state of a run on its way into a checkpoint or out of one. Members are named once, for both directions, so that
/// what is written and what is read cannot differ. Numbers are as the machine has them: a checkpoint is for the same
/// program on the same architecture.
class StateArchive {
 public:
  /// Writes.
  StateArchive() = default;
  /// Reads; the bytes must outlive the archive.
  explicit StateArchive(std::string_view bytes) : reading_(true), source_(bytes) {}

  bool reading() const { return reading_; }
  std::string take_bytes() { return std::move(written_); }
  /// What has not been read yet.
  std::string_view rest() const { return source_; }
  /// \throw CheckpointError when bytes are left over
  void finish() const {
    if (!source_.empty()) throw CheckpointError("the checkpoint is longer than the state of this run");
  }

  /// A number, or a structure of numbers. \throw CheckpointError at the end of the bytes
  template <typename Value>
  void value(Value& value) {
    bytes(&value, sizeof value);
  }

  /// As many items as `items` has now. \throw CheckpointError for another number
  template <typename Item>
  void values(std::vector<Item>& items) {
    count(items.size());
    bytes(items.data(), items.size() * sizeof(Item));
  }

  /// Of any length.
  void text(std::string& text) {
    auto size = static_cast<std::uint64_t>(text.size());
    value(size);
    if (reading_) {
      if (size > source_.size()) throw CheckpointError("the checkpoint ends early");
      text.resize(size);
    }
    bytes(text.data(), size);
  }

  /// None, or `full` items.
  template <typename Item>
  void values_or_none(std::vector<Item>& items, std::size_t full) {
    std::uint8_t some = items.empty() ? 0 : 1;
    value(some);
    if (reading_) items.resize(some == 0 ? 0 : full);
    values(items);
  }

 private:
  void count(std::size_t expected) {
    std::uint64_t found = expected;
    value(found);
    if (found != expected) throw CheckpointError("the checkpoint is one of another mesh or other parameters");
  }

  // Plain arithmetic types and Eigen's fixed vectors of them, which are nothing but their numbers.
  void bytes(void* data, std::size_t size) {
    if (!reading_) {
      written_.append(static_cast<const char*>(data), size);
      return;
    }
    if (size > source_.size()) throw CheckpointError("the checkpoint ends early");
    if (size > 0) std::memcpy(data, source_.data(), size);
    source_.remove_prefix(size);
  }

  bool reading_ = false;
  std::string written_;
  std::string_view source_;
};

}  // namespace crease
