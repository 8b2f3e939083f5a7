#pragma once

#include <cstddef>
#include <deque>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "colmap_graphmatch/base/stop_request.h"
#include "colmap_graphmatch/base/types.h"
#include "colmap_graphmatch/database/database.h"

namespace colmap_graphmatch {

// A part of a shard that is finished.
struct ShardPart {
  using Failure = std::pair<ImagePair, std::string>;  // What went wrong with the pair.

  std::vector<PairGeometry> results;
  std::vector<Failure> failures;
  bool is_verified = true;  // By a GeometryVerifier that may fail; else the pairs were hopeless.
};

// Has shards worked on by threads of its own, and hands what they finish to the calling thread, so
// that one thread alone writes.
class ShardRunner {
 public:
  using Shard = std::vector<ImagePair>;

  // What a worker sees of the run.
  class Progress {
   public:
    virtual ~Progress() = default;
    virtual void Finish(ShardPart part) = 0;
    // Whether what is under way is to be given up.
    virtual bool GivesUp() const = 0;
  };
  using Work = std::function<void(const Shard&, Progress&)>;

  // At most max_num_workers threads; fewer where the system allows fewer threads, or where a
  // worker meets a limit of the system (SystemLimitError): it puts its shard back and leaves it to
  // the others. Where it gets no thread at all, the calling one does the work.
  ShardRunner(std::size_t max_num_workers, const StopRequest& stop);

  // Calls work for every shard, on the workers, and merge for every part, on the calling thread.
  // Leaves out shards, and parts of those under way, as the stop request says. Rethrows what work
  // or merge throws when all workers have ended, but for StoppedError, which ends the run like the
  // stop request.
  void Run(std::deque<Shard> shards, const Work& work,
           const std::function<void(const ShardPart&)>& merge);

 private:
  struct Batch;

  void WorkOnAll(Batch* batch) const;
  bool WorkOnNext(Batch* batch, Shard* shard) const;
  bool PutBack(const Shard& shard, Batch* batch) const;

  std::size_t max_num_workers_;
  const StopRequest& stop_;
};

}  // namespace colmap_graphmatch
