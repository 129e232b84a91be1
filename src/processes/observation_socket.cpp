#include "sentree/processes/detail/observation_socket.h"

#include <poll.h>
#include <sys/socket.h>
#include <sys/time.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <optional>
#include <system_error>
#include <utility>

#include "sentree/base/temporary_folder.h"
#include "sentree/processes/wire_message.h"
#include "sentree/text/json.h"

namespace sentree::processes {

namespace {

// Long enough for the observations of a call, short beside a tick; the kernel's queue holds ten by default.
constexpr std::chrono::microseconds kGatherTime{500};

std::optional<sockaddr_un> address_of(const std::string& path) {
  sockaddr_un at{};
  at.sun_family = AF_UNIX;
  if (path.size() >= sizeof at.sun_path) return std::nullopt;
  std::memcpy(at.sun_path, path.c_str(), path.size() + 1);
  return at;
}

}  // namespace

std::string observation_path(const std::string& observer_path) { return observer_path + ".observations"; }

Result<std::unique_ptr<ObservationInbox>> ObservationInbox::open(const std::string& path,
                                                                 std::function<void(Message)> take,
                                                                 std::function<void(const std::string&)> problem) {
  const auto at = address_of(path);
  const int socket = at ? ::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0) : -1;
  if (socket < 0 || ::bind(socket, reinterpret_cast<const sockaddr*>(&*at), sizeof *at) != 0) {
    const std::string why = at ? std::generic_category().message(errno) : "a socket's path has 107 octets at most";
    if (socket >= 0) ::close(socket);
    return fail("observer.socket", "no socket for observations: " + why, SourceSpan{path});
  }
  return std::unique_ptr<ObservationInbox>(new ObservationInbox(socket, path, std::move(take), std::move(problem)));
}

ObservationInbox::ObservationInbox(int socket, std::string path, std::function<void(Message)> take,
                                   std::function<void(const std::string&)> problem)
    : socket_(socket),
      path_(std::move(path)),
      take_(std::move(take)),
      problem_(std::move(problem)),
      buffer_(kObservationBytesMax),
      reader_([this] { read(); }) {}

ObservationInbox::~ObservationInbox() {
  close();
  ::close(socket_);
}

void ObservationInbox::read() {
  for (;;) {
    pollfd watched{socket_, POLLIN, 0};
    ::poll(&watched, 1, -1);
    drain();
    {
      const std::lock_guard lock(mutex_);
      if (closed_) return;
    }
    // Whoever needs them drains; for all others a few at a time wake fewer processors.
    std::this_thread::sleep_for(kGatherTime);
  }
}

void ObservationInbox::drain() {
  const std::lock_guard lock(mutex_);
  for (;;) {
    const ssize_t size = ::recv(socket_, buffer_.data(), buffer_.size(), MSG_DONTWAIT | MSG_TRUNC);
    if (size < 0 && errno == EINTR) continue;
    if (size <= 0) return;
    const auto bytes = static_cast<std::size_t>(size);
    const auto json = text::parse_json({buffer_.data(), std::min(bytes, buffer_.size())});
    if (bytes > buffer_.size() || !json || json->as_map() == nullptr) {
      problem_("an observation that another process left cannot be read and is lost");
      continue;
    }
    take_(message_from_json(*json));
  }
}

void ObservationInbox::close() {
  {
    const std::lock_guard lock(mutex_);
    if (std::exchange(closed_, true)) return;
  }
  ::unlink(path_.c_str());
  // What is in the queue stays readable; the reader wakes and ends.
  ::shutdown(socket_, SHUT_RD);
  reader_.join();
  drain();
}

std::unique_ptr<ObservationOutbox> ObservationOutbox::connect(const std::string& path) {
  const auto at = address_of(path);
  const int socket = at ? ::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0) : -1;
  if (socket < 0) return nullptr;
  if (::connect(socket, reinterpret_cast<const sockaddr*>(&*at), sizeof *at) != 0) {
    ::close(socket);
    return nullptr;
  }
  keep_temporary_folder(std::filesystem::path(path).parent_path());
  const timeval patience{1, 0};
  ::setsockopt(socket, SOL_SOCKET, SO_SNDTIMEO, &patience, sizeof patience);
  return std::unique_ptr<ObservationOutbox>(new ObservationOutbox(socket));
}

ObservationOutbox::~ObservationOutbox() { ::close(socket_); }

bool ObservationOutbox::send(const Message& message) {
  const std::string line = to_json(message);
  if (line.size() > kObservationBytesMax) return false;
  for (;;) {
    const ssize_t sent = ::send(socket_, line.data(), line.size(), MSG_NOSIGNAL);
    if (sent >= 0) return true;
    if (errno != EINTR) return false;
  }
}

}  // namespace sentree::processes
