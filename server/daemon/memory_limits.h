// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "absl/status/status.h"

namespace carillon {

/// Checks that the system gives the daemon what it needs to start, and to serve a few clients. The
/// soft limit of descriptors is raised to that number. As many threads as the daemon needs are
/// begun and ended, with as much address space, because gRPC waits for ever for a thread that the
/// system refuses. Errors: ResourceExhausted (TOO_FEW_DESCRIPTORS, SERVER_OUT_OF_MEMORY).
absl::Status CheckLimits();

/// Lets an exception that no thread catches end the process with a line of the log. Lack of memory
/// or threads ends it with status 1, anything else by abort. Nothing is unwound, because
/// destructors could wait for threads that do not run; the database is written as for a loss of
/// power.
void ReportUncaughtExceptions();

/// Lets lack of memory or threads end the process with status 0 from now on, because it is stopping
/// anyway. A library may need a thread for its own stop.
void ExpectEnd();

}  // namespace carillon
