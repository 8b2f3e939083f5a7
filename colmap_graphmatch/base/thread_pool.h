#pragma once

#include <cstddef>
#include <functional>
#include <memory>
#include <thread>
#include <vector>

namespace colmap_graphmatch {

// Threads that do the same work, each once.
class ThreadGroup {
 public:
  // Starts up to num_threads threads that call work(), which may not throw: fewer, perhaps none,
  // if the system lets this process have no more (ulimit -u, limits of containers and clusters).
  ThreadGroup(std::size_t num_threads, const std::function<void()>& work);
  ~ThreadGroup() { Join(); }
  ThreadGroup(const ThreadGroup&) = delete;
  ThreadGroup& operator=(const ThreadGroup&) = delete;

  std::size_t Size() const { return threads_.size(); }

  // Returns when all have ended; then there are none.
  void Join();

 private:
  std::vector<std::thread> threads_;
};

// A fixed number of threads for loops whose iterations are independent of each other. Results never
// depend on the number of threads as long as iteration i writes only what belongs to i.
class ThreadPool {
 public:
  // num_threads: at least 1, or -1 for all cores. Throws OptionsError for any other value. Has
  // fewer where the system lets this process have no more.
  explicit ThreadPool(int num_threads);
  ~ThreadPool();

  ThreadPool(const ThreadPool&) = delete;
  ThreadPool& operator=(const ThreadPool&) = delete;

  int NumThreads() const { return num_threads_; }

  // Calls body(0) .. body(count - 1), each exactly once, on the threads of the pool and on the
  // calling one, and returns when all are done. If calls throw, the remaining ones are skipped and
  // one of the exceptions is rethrown here. Not to be called from within body.
  void ParallelFor(std::size_t count, const std::function<void(std::size_t)>& body);

 private:
  struct Workers;

  int num_threads_;
  std::unique_ptr<Workers> workers_;
};

// The number of threads that -1 stands for; num_threads itself if it is at least 1. Throws
// OptionsError for any other value.
int EffectiveNumThreads(int num_threads);

}  // namespace colmap_graphmatch
