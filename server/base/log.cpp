#include "server/base/log.h"

#include <fmt/chrono.h>
#include <spdlog/formatter.h>
#include <spdlog/sinks/stdout_sinks.h>
#include <spdlog/spdlog.h>
#include <unistd.h>

#include <chrono>
#include <memory>

namespace creased {
namespace {

using Json = nlohmann::ordered_json;

// The fields of the message being logged. The sink formats on the calling thread, so a thread-local reaches it.
thread_local const Json* current_fields = nullptr;

std::string timestamp(std::chrono::system_clock::time_point time) {
  const auto since_epoch = std::chrono::duration_cast<std::chrono::milliseconds>(time.time_since_epoch());
  const auto whole = std::chrono::duration_cast<std::chrono::seconds>(since_epoch);
  return fmt::format("{:%FT%T}.{:03}Z", fmt::gmtime(static_cast<std::time_t>(whole.count())),
                     (since_epoch - whole).count());
}

std::string dump(const Json& value) { return value.dump(-1, ' ', false, Json::error_handler_t::replace); }

std::string_view view(const spdlog::string_view_t& text) { return {text.data(), text.size()}; }

bool is_plain(const std::string& text) {
  return !text.empty() && text.find_first_of(" \"=\\") == std::string::npos &&
         std::all_of(text.begin(), text.end(), [](unsigned char c) { return c > 0x20 && c < 0x7f; });
}

std::string text_value(const Json& value) {
  if (value.is_string() && is_plain(value.get_ref<const std::string&>())) return value.get<std::string>();
  return dump(value);
}

std::string one_line(std::string_view text) {
  std::string line(text);
  std::replace_if(
      line.begin(), line.end(), [](unsigned char c) { return c < 0x20 || c == 0x7f; }, ' ');
  return line;
}

class LineFormatter : public spdlog::formatter {
 public:
  explicit LineFormatter(bool as_json) : as_json_(as_json) {}

  void format(const spdlog::details::log_msg& message, spdlog::memory_buf_t& out) override {
    const std::string line = as_json_ ? json_line(message) : text_line(message);
    out.append(line.data(), line.data() + line.size());
  }

  std::unique_ptr<spdlog::formatter> clone() const override { return std::make_unique<LineFormatter>(as_json_); }

 private:
  static std::string json_line(const spdlog::details::log_msg& message) {
    Json object = {{"time", timestamp(message.time)},
                   {"level", std::string(view(spdlog::level::to_string_view(message.level)))},
                   {"pid", ::getpid()},
                   {"message", std::string(view(message.payload))}};
    if (current_fields != nullptr) object.update(*current_fields);
    return dump(object) + "\n";
  }

  static std::string text_line(const spdlog::details::log_msg& message) {
    std::string line =
        fmt::format("{} {:<8} [{}] {}", timestamp(message.time), view(spdlog::level::to_string_view(message.level)),
                    ::getpid(), one_line(view(message.payload)));
    if (current_fields != nullptr) {
      for (const auto& [name, value] : current_fields->items()) line += " " + name + "=" + text_value(value);
    }
    return line + "\n";
  }

  bool as_json_;
};

}  // namespace

void configure_log(const std::string& format, const std::string& level) {
  auto logger = std::make_shared<spdlog::logger>("creased", std::make_shared<spdlog::sinks::stderr_sink_mt>());
  logger->set_formatter(std::make_unique<LineFormatter>(format == "json"));
  logger->set_level(spdlog::level::from_str(level));
  logger->flush_on(spdlog::level::trace);
  spdlog::set_default_logger(std::move(logger));
}

void log_event(spdlog::level::level_enum level, std::string_view event, const Json& fields) {
  current_fields = &fields;
  spdlog::log(level, "{}", event);
  current_fields = nullptr;
}

std::string timestamp_now() { return timestamp(std::chrono::system_clock::now()); }

}  // namespace creased
