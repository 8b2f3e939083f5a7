#include "colmap_graphmatch/base/thread_pool.h"

#include <algorithm>
#include <atomic>
#include <boost/asio/executor_work_guard.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/post.hpp>
#include <condition_variable>
#include <exception>
#include <mutex>
#include <string>
#include <thread>

#include "colmap_graphmatch/base/errors.h"

namespace colmap_graphmatch {

ThreadGroup::ThreadGroup(std::size_t num_threads, const std::function<void()>& work) {
  try {
    threads_.reserve(num_threads);
    while (threads_.size() < num_threads) threads_.emplace_back(work);
  } catch (const std::exception&) {
    // For want of threads or of memory: those that there are do it.
  }
}

void ThreadGroup::Join() {
  for (std::thread& thread : threads_) thread.join();
  threads_.clear();
}

// Not Boost's thread_pool: its constructor waits for ever if it cannot start all of its threads.
struct ThreadPool::Workers {
  explicit Workers(std::size_t num_threads) {
    Start(num_threads);
    if (threads->Size() == num_threads) return;
    // Others are to come, and processes, under the same limit.
    const std::size_t num_started = threads->Size();
    context.stop();
    threads->Join();
    context.restart();
    Start(num_started / 2);
  }
  ~Workers() { context.stop(); }
  Workers(const Workers&) = delete;
  Workers& operator=(const Workers&) = delete;

  void Start(std::size_t num_threads) {
    threads = std::make_unique<ThreadGroup>(num_threads, [this] { context.run(); });
  }

  boost::asio::io_context context;
  boost::asio::executor_work_guard<boost::asio::io_context::executor_type> open{
      context.get_executor()};
  std::unique_ptr<ThreadGroup> threads;
};

int EffectiveNumThreads(int num_threads) {
  if (num_threads == -1) {
    return std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
  }
  if (num_threads < 1) {
    throw OptionsError("The number of threads is " + std::to_string(num_threads) +
                       "; it must be at least 1, or -1 for all cores.");
  }
  return num_threads;
}

ThreadPool::ThreadPool(int num_threads) : num_threads_(EffectiveNumThreads(num_threads)) {
  if (num_threads_ > 1) {
    workers_ = std::make_unique<Workers>(static_cast<std::size_t>(num_threads_ - 1));
    num_threads_ = static_cast<int>(workers_->threads->Size()) + 1;
  }
}

ThreadPool::~ThreadPool() = default;

void ThreadPool::ParallelFor(std::size_t count, const std::function<void(std::size_t)>& body) {
  std::atomic<std::size_t> next{0};
  std::mutex mutex;
  std::condition_variable finished;
  std::exception_ptr exception;
  std::size_t num_running = 0;

  const auto work = [&] {
    try {
      for (std::size_t i = next++; i < count; i = next++) {
        body(i);
      }
    } catch (...) {
      next = count;
      const std::lock_guard<std::mutex> lock(mutex);
      if (!exception) exception = std::current_exception();
    }
  };

  if (num_threads_ > 1 && count > 1) {
    num_running = std::min(count, static_cast<std::size_t>(num_threads_)) - 1;
    for (std::size_t i = num_running; i > 0; --i) {
      boost::asio::post(workers_->context, [&] {
        work();
        // Notified under the lock: the waiting thread destroys the condition once it can leave.
        const std::lock_guard<std::mutex> lock(mutex);
        --num_running;
        finished.notify_one();
      });
    }
  }
  work();
  std::unique_lock<std::mutex> lock(mutex);
  finished.wait(lock, [&] { return num_running == 0; });
  if (exception) std::rethrow_exception(exception);
}

}  // namespace colmap_graphmatch
