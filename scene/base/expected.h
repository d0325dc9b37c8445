// Errors as values: what went wrong, where, and what to do about it. Only main turns a kind into an exit code.
#pragma once

#include <optional>
#include <string>
#include <utility>
#include <variant>

namespace lumel {

enum class ErrorKind {
  Failed,       // exit 1: the work itself failed (no disk space, out of memory)
  Usage,        // exit 2: the command line or config is wrong
  Input,        // exit 3: a file that was given is wrong
  Threshold,    // exit 4: done, but beyond a threshold that was asked for
  Interrupted,  // exit 130: Ctrl-C
};

/// One line for the user: "FILE: WHERE: what is wrong; what to do".
struct Error {
  ErrorKind kind = ErrorKind::Failed;
  std::string message;
};

inline Error inputError(std::string message) { return {ErrorKind::Input, std::move(message)}; }
inline Error usageError(std::string message) { return {ErrorKind::Usage, std::move(message)}; }
inline Error failure(std::string message) { return {ErrorKind::Failed, std::move(message)}; }
inline Error interrupted() { return {ErrorKind::Interrupted, "interrupted"}; }

/// A value or an Error (g++ 12 has no std::expected). Dereferencing an error is a bug in the caller.
template <class T>
class [[nodiscard]] Expected {
 public:
  Expected(T value) : state_(std::in_place_index<0>, std::move(value)) {}
  Expected(Error error) : state_(std::in_place_index<1>, std::move(error)) {}

  explicit operator bool() const { return state_.index() == 0; }
  T& operator*() & { return std::get<0>(state_); }
  const T& operator*() const& { return std::get<0>(state_); }
  T&& operator*() && { return std::get<0>(std::move(state_)); }
  T* operator->() { return &std::get<0>(state_); }
  const T* operator->() const { return &std::get<0>(state_); }
  const Error& error() const { return std::get<1>(state_); }

 private:
  std::variant<T, Error> state_;
};

template <>
class [[nodiscard]] Expected<void> {
 public:
  Expected() = default;
  Expected(Error error) : error_(std::move(error)) {}

  explicit operator bool() const { return !error_.has_value(); }
  const Error& error() const { return *error_; }

 private:
  std::optional<Error> error_;
};

}  // namespace lumel
