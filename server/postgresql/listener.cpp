#include "server/postgresql/listener.h"

#include <fmt/format.h>
#include <poll.h>
#include <spdlog/spdlog.h>
#include <sys/eventfd.h>

#include <algorithm>
#include <charconv>
#include <optional>
#include <pqxx/pqxx>
#include <utility>

#include "server/base/failure.h"

namespace creased {
namespace code = crease::code;
namespace {

using std::chrono::milliseconds;

constexpr milliseconds kFirstPauseOfListener{50}, kLongestPauseOfListener{5'000};
/// How often the connection is tried, and what may have been missed is looked for.
constexpr milliseconds kSafetyCheck{10'000};

std::uint64_t number_in(const std::string& text) {
  std::uint64_t number = 0;
  std::from_chars(text.data(), text.data() + text.size(), number);
  return number;
}

}  // namespace

class Listener::Ear final : public pqxx::notification_receiver {
 public:
  Ear(pqxx::connection& connection, Listener& listener, Channel channel)
      : pqxx::notification_receiver(connection, name_of(channel)), listener_(listener), channel_(channel) {}
  void operator()(const std::string& payload, int) override { listener_.hear(channel_, payload); }

 private:
  Listener& listener_;
  const Channel channel_;
};

Listener::Listener(std::string url)
    : url_(std::move(url)),
      wake_(::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)),
      thread_([this](const auto& ended) { run(ended); }) {
  if (!wake_.open()) throw crease::Error(code::kProcessUnavailable, "cannot make an event: " + errno_text(errno));
}

Listener::~Listener() {
  thread_.request_stop();
  ::eventfd_write(wake_.get(), 1);
}

/// Returns whether the channel can be heard.
bool Listener::want(Channel channel) {
  const auto place = static_cast<std::size_t>(channel);
  if (!wanted_.at(place).exchange(true)) {
    ::eventfd_write(wake_.get(), 1);
    const std::lock_guard lock(mutex_);
    changed_.notify_all();
  }
  return heard_.at(place);
}

std::uint64_t Listener::signals(Channel channel) {
  return want(channel) ? signals_.at(static_cast<std::size_t>(channel)).load() : 0;
}

std::uint64_t Listener::last_version() { return want(Channel::kChanges) ? version_.load() : 0; }

void Listener::note_version(std::uint64_t version) {
  auto known = version_.load();
  while (known < version && !version_.compare_exchange_weak(known, version)) {
  }
}

void Listener::hear(Channel channel, const std::string& payload) {
  if (channel == Channel::kChanges) note_version(number_in(payload));
  ++signals_.at(static_cast<std::size_t>(channel));
}

void Listener::set_deaf() {
  for (auto& heard : heard_) heard = false;
}

void Listener::run(const std::stop_token& ended) {
  auto pause = kFirstPauseOfListener;
  std::unique_lock lock(mutex_);
  const auto wanted = [this] {
    return std::ranges::any_of(wanted_, [](const auto& channel) { return channel.load(); });
  };
  while (changed_.wait(lock, ended, wanted) && !ended.stop_requested()) {
    lock.unlock();
    try {
      listen(ended);
      pause = kFirstPauseOfListener;
    } catch (const pqxx::pqxx_exception& exception) {
      const std::string_view what = exception.base().what();
      spdlog::warn("the database does not tell what happens: {}", what.substr(0, what.find('\n')));
    }
    set_deaf();
    lock.lock();
    changed_.wait_for(lock, ended, pause, [] { return false; });
    pause = std::min(pause * 2, kLongestPauseOfListener);
  }
}

/// Listens until the connection is lost or `ended`.
void Listener::listen(const std::stop_token& ended) {
  pqxx::connection connection(url_);
  const pqxx::quiet_errorhandler quiet(connection);
  std::array<std::optional<Ear>, kChannelNames.size()> ears;
  bool check = true;
  while (!ended.stop_requested()) {
    for (std::size_t place = 0; place < ears.size(); ++place) {
      if (!wanted_.at(place) || ears.at(place)) continue;
      ears.at(place).emplace(connection, *this, static_cast<Channel>(place));
      check = true;
    }
    if (check) {
      // What came before the channel could be heard is one more signal.
      const auto row = pqxx::nontransaction(connection).exec1("SELECT version FROM change_counter");
      note_version(row[0].as<std::uint64_t>());
      for (std::size_t place = 0; place < ears.size(); ++place) {
        if (!ears.at(place)) continue;
        ++signals_.at(place);
        heard_.at(place) = true;
      }
    }
    std::array<pollfd, 2> watched{{{.fd = connection.sock(), .events = POLLIN, .revents = 0},
                                   {.fd = wake_.get(), .events = POLLIN, .revents = 0}}};
    check = ::poll(watched.data(), watched.size(), static_cast<int>(kSafetyCheck.count())) == 0;
    eventfd_t ignored = 0;
    ::eventfd_read(wake_.get(), &ignored);
    if (watched.front().revents != 0) connection.get_notifs();
  }
}

}  // namespace creased
