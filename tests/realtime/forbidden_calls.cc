// SPDX-License-Identifier: Apache-2.0
#include "tests/realtime/forbidden_calls.h"

#include <dlfcn.h>
#include <pthread.h>

namespace carillon {
namespace {

thread_local bool watching = false;
thread_local size_t call_count = 0;

[[maybe_unused]] void Note() { call_count += watching ? 1 : 0; }

}  // namespace

ForbiddenCalls::ForbiddenCalls() {
  call_count = 0;
  watching = true;
}

ForbiddenCalls::~ForbiddenCalls() { watching = false; }

size_t ForbiddenCalls::count() const { return call_count; }

}  // namespace carillon

#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
// The program's own definitions come before the C library's, for every library it loads.
extern "C" {

// NOLINTBEGIN(readability-identifier-naming): the C library named them.
void* __libc_malloc(size_t size);
void* __libc_calloc(size_t count, size_t size);
void* __libc_realloc(void* old, size_t size);
void* __libc_memalign(size_t alignment, size_t size);
void __libc_free(void* old);
// NOLINTEND(readability-identifier-naming)

void* malloc(size_t size) {
  carillon::Note();
  return __libc_malloc(size);
}

void* calloc(size_t count, size_t size) {
  carillon::Note();
  return __libc_calloc(count, size);
}

void* realloc(void* old, size_t size) {
  carillon::Note();
  return __libc_realloc(old, size);
}

void* aligned_alloc(size_t alignment, size_t size) {
  carillon::Note();
  return __libc_memalign(alignment, size);
}

void free(void* old) {
  carillon::Note();
  __libc_free(old);
}

int pthread_mutex_lock(pthread_mutex_t* mutex) noexcept {
  carillon::Note();
  using Lock = int (*)(pthread_mutex_t*);
  static const Lock lock = reinterpret_cast<Lock>(dlsym(RTLD_NEXT, "pthread_mutex_lock"));
  return lock(mutex);
}

}  // extern "C"
#endif
