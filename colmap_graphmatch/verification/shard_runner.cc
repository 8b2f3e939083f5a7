#include "colmap_graphmatch/verification/shard_runner.h"

#include <algorithm>
#include <atomic>
#include <condition_variable>
#include <exception>
#include <iterator>
#include <mutex>
#include <unordered_set>

#include "colmap_graphmatch/base/errors.h"
#include "colmap_graphmatch/base/thread_pool.h"

namespace colmap_graphmatch {

// What the calling thread and the workers share.
struct ShardRunner::Batch : public ShardRunner::Progress {
  Batch(std::deque<Shard> all_shards, const Work& with, const StopRequest& until)
      : work(with), stop(until), shards(std::move(all_shards)) {}

  void Finish(ShardPart part) override {
    const std::lock_guard<std::mutex> lock(mutex);
    for (const PairGeometry& result : part.results) answered.insert(result.pair);
    for (const ShardPart::Failure& failure : part.failures) answered.insert(failure.first);
    finished.push_back(std::move(part));
    changed.notify_all();
  }

  bool GivesUp() const override { return stop.Abandon() || abort; }

  // Under the lock.
  void EndWorker() {
    --num_workers;
    changed.notify_all();
  }

  void Abort() {
    const std::lock_guard<std::mutex> lock(mutex);
    abort = true;
    changed.notify_all();
  }

  // The end of a worker, and of all.
  void Fail(std::exception_ptr with) {
    const std::lock_guard<std::mutex> lock(mutex);
    if (!exception) exception = std::move(with);
    abort = true;
    EndWorker();
  }

  const Work& work;
  const StopRequest& stop;

  std::mutex mutex;
  std::condition_variable changed;         // finished, num_workers or abort.
  std::deque<Shard> shards;                // Not yet taken.
  std::deque<ShardPart> finished;          // Not yet merged.
  std::unordered_set<ImagePair> answered;  // Finished pairs of the shards under way.
  std::size_t num_workers = 0;
  bool last_has_put_back = false;  // The last worker met a limit of the system, and tried again.
  std::size_t num_limited = 0;     // Workers that ended since the system has no room for them.
  std::exception_ptr exception;
  std::atomic<bool> abort{false};
};

ShardRunner::ShardRunner(std::size_t max_num_workers, const StopRequest& stop)
    : max_num_workers_(std::max<std::size_t>(max_num_workers, 1)), stop_(stop) {}

bool ShardRunner::PutBack(const Shard& shard, Batch* batch) const {
  const std::lock_guard<std::mutex> lock(batch->mutex);
  const bool is_last = batch->num_workers == 1;
  // The others may have left only just now.
  if (is_last && std::exchange(batch->last_has_put_back, true)) throw;
  // What was finished of it is not to be done again.
  Shard left;
  std::copy_if(shard.begin(), shard.end(), std::back_inserter(left),
               [batch](const ImagePair& pair) { return batch->answered.count(pair) == 0; });
  batch->shards.push_front(std::move(left));
  if (is_last) return true;
  ++batch->num_limited;
  batch->EndWorker();
  return false;
}

bool ShardRunner::WorkOnNext(Batch* batch, Shard* shard) const {
  {
    std::unique_lock<std::mutex> lock(batch->mutex);
    // What is not in the database yet is lost if we are killed: it must not pile up.
    batch->changed.wait(lock,
                        [&] { return batch->abort || batch->finished.size() <= max_num_workers_; });
    if (batch->shards.empty() || batch->abort || stop_.Requested()) {
      // Under the same lock: nobody is to leave a shard to a thread that goes.
      batch->EndWorker();
      return false;
    }
    *shard = std::move(batch->shards.front());
    batch->shards.pop_front();
  }
  batch->work(*shard, *batch);
  const std::lock_guard<std::mutex> lock(batch->mutex);
  for (const ImagePair& pair : *shard) batch->answered.erase(pair);
  return true;
}

void ShardRunner::WorkOnAll(Batch* batch) const {
  Shard shard;
  try {
    for (bool goes_on = true; goes_on;) {
      try {
        goes_on = WorkOnNext(batch, &shard);
      } catch (const SystemLimitError&) {
        // While it is handled: PutBack may throw it on.
        goes_on = PutBack(shard, batch);
      }
    }
  } catch (const StoppedError&) {
    // While it waited for the database: the others finish what they have.
    const std::lock_guard<std::mutex> lock(batch->mutex);
    batch->EndWorker();
  } catch (...) {
    batch->Fail(std::current_exception());
  }
}

void ShardRunner::Run(std::deque<Shard> shards, const Work& work,
                      const std::function<void(const ShardPart&)>& merge) {
  Batch batch(std::move(shards), work, stop_);
  // They begin when it is known how many they are.
  std::unique_lock<std::mutex> starting(batch.mutex);
  ThreadGroup workers(std::min(batch.shards.size(), max_num_workers_), [this, &batch] {
    { const std::lock_guard<std::mutex> started(batch.mutex); }
    WorkOnAll(&batch);
  });
  // Where the system gives no thread, this one takes turns.
  const bool works_itself = workers.Size() == 0;
  batch.num_workers = works_itself ? 1 : workers.Size();
  starting.unlock();

  try {
    Shard own_shard;
    std::unique_lock<std::mutex> lock(batch.mutex);
    while (true) {
      if (works_itself && batch.finished.empty() && batch.num_workers > 0) {
        lock.unlock();
        WorkOnNext(&batch, &own_shard);
        lock.lock();
        continue;
      }
      batch.changed.wait(lock, [&] { return !batch.finished.empty() || batch.num_workers == 0; });
      if (batch.finished.empty()) break;
      const ShardPart part = std::move(batch.finished.front());
      batch.finished.pop_front();
      batch.changed.notify_all();
      lock.unlock();
      merge(part);
      lock.lock();
    }
  } catch (const StoppedError&) {
    // What could not be written while it waited for the database is given up.
    batch.Abort();
    workers.Join();
    return;
  } catch (...) {
    batch.Abort();
    workers.Join();
    throw;
  }
  workers.Join();
  if (batch.exception) std::rethrow_exception(batch.exception);
  // There will be no more room for the next ones.
  max_num_workers_ -= std::min(batch.num_limited, max_num_workers_ - 1);
}

}  // namespace colmap_graphmatch
