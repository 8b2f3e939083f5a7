// Preloaded into graphmatch_matcher, it has the system refuse threads or processes
// (GRAPHMATCH_TEST_REFUSE is thread or process): from the GRAPHMATCH_TEST_FROM-th on, or, if
// GRAPHMATCH_TEST_ONCE is set, that one alone.

#include <dlfcn.h>
#include <pthread.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <cstdlib>
#include <cstring>

namespace {

std::atomic<int> num_asked{0};

bool Refuses(const char* what) {
  const char* refused = std::getenv("GRAPHMATCH_TEST_REFUSE");
  const char* from = std::getenv("GRAPHMATCH_TEST_FROM");
  if (refused == nullptr || from == nullptr || std::strcmp(refused, what) != 0) return false;
  if (std::strcmp(program_invocation_short_name, "graphmatch_matcher") != 0) return false;
  const int number = ++num_asked;
  return std::getenv("GRAPHMATCH_TEST_ONCE") != nullptr ? number == std::atoi(from)
                                                        : number >= std::atoi(from);
}

}  // namespace

extern "C" int pthread_create(pthread_t* thread, const pthread_attr_t* attributes,
                              void* (*start)(void*), void* argument) noexcept {
  using Create = int (*)(pthread_t*, const pthread_attr_t*, void* (*)(void*), void*);
  if (Refuses("thread")) return EAGAIN;
  return reinterpret_cast<Create>(::dlsym(RTLD_NEXT, "pthread_create"))(thread, attributes, start,
                                                                        argument);
}

extern "C" pid_t fork() noexcept {
  using Fork = pid_t (*)();
  if (Refuses("process")) {
    errno = EAGAIN;
    return -1;
  }
  return reinterpret_cast<Fork>(::dlsym(RTLD_NEXT, "fork"))();
}
