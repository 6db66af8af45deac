// SPDX-License-Identifier: Apache-2.0
// A call that takes long, as Python wants it: the interpreter goes on meanwhile, Ctrl-C is heard, and Python code that
// the call comes back to may raise.
#pragma once

#include <pybind11/pybind11.h>

#include <atomic>
#include <chrono>
#include <future>
#include <optional>
#include <string>
#include <utility>

#include "base/job.h"
#include "base/result.h"

namespace farfield::python {

namespace py = pybind11;

/// Throws farfield.Error, with the code's name.
[[noreturn]] void raise(const Error& error);

template <typename T>
T value_or_raise(Result<T> result) {
  if (!result) raise(result.error());
  return std::move(*result);
}

/// Made, used and destroyed on one thread that holds the GIL.
class LongCall {
 public:
  /// progress: None, or a function of (done, stage).
  explicit LongCall(py::object progress) : progress_(std::move(progress)) {}
  LongCall(const LongCall&) = delete;
  LongCall& operator=(const LongCall&) = delete;

  const std::atomic<bool>& cancel() const { return cancel_; }
  Job job() {
    Job job{{}, &cancel_};
    if (!progress_.is_none()) job.progress = [this](double done, const std::string& stage) { report(done, stage); };
    return job;
  }
  void report(double done, const std::string& stage) {
    call_python([&] { progress_(done, stage); });
  }

  /// Runs Python code, from any thread. Once it has raised, the call is cancelled and no more of it runs.
  template <typename Body>
  void call_python(const Body& body) {
    const py::gil_scoped_acquire gil;
    if (raised_) return;
    try {
      body();
    } catch (py::error_already_set& raised) {
      raised_.emplace(raised);
      cancel_ = true;
    }
  }

  /// work() on a thread of its own, without the GIL. Throws what Python code has raised meanwhile.
  template <typename Work>
  auto run(const Work& work) {
    auto result = std::async(std::launch::async, work);
    {
      const py::gil_scoped_release others_run;
      while (result.wait_for(std::chrono::milliseconds(50)) != std::future_status::ready) {
        call_python([] {
          if (PyErr_CheckSignals() != 0) throw py::error_already_set();
        });
      }
    }
    if (raised_) throw *std::exchange(raised_, std::nullopt);
    return value_or_raise(result.get());
  }

 private:
  py::object progress_;
  std::atomic<bool> cancel_{false};
  std::optional<py::error_already_set> raised_;  // guarded by the GIL
};

}  // namespace farfield::python
