#pragma once

#include <atomic>

/// The first SIGINT or SIGTERM requests an end with the results so far, which commands poll; a command that
/// has not ended kGrace later is ended with exit code 130, once the results that are being written are
/// complete, or nobody has read them for half a second. A command that is ended without its report says so on
/// standard error. Another signal, a second or more after the first, ends the program at once. Sooner ones
/// are the same request: `timeout`, for one, signals the program and then its whole group.
const std::atomic<bool>& StopRequested();

/// SIGUSR1 asks a run to pause, SIGUSR2 to go on.
const std::atomic<bool>& PauseRequested();

/// A signal from now on ends the program at once with exit code 130: its work is done.
void FinishSignals();
