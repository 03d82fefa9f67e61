#pragma once

#include <atomic>

/// The first SIGINT or SIGTERM asks for an end with what was found so far, which commands look at; whatever
/// has not ended kGrace later is ended with exit code 130, once the results that are being written are whole,
/// or nobody takes them for half a second. What is ended without its report says so on standard error.
/// Another signal, a second or more after the first, ends the program at once. Sooner ones are the same
/// request: `timeout`, for one, signals the program and then its whole group.
const std::atomic<bool>& StopRequested();

/// A signal from now on ends the program at once with exit code 130: its work is done.
void FinishSignals();
