#pragma once

#include <cstddef>
#include <functional>
#include <memory>

namespace colmap_graphmatch {

// A fixed number of threads for loops whose iterations are independent of each other. Results never
// depend on the number of threads as long as iteration i writes only what belongs to i.
class ThreadPool {
 public:
  // num_threads: at least 1, or -1 for all cores. Throws OptionsError for any other value.
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
