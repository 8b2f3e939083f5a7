#pragma once

#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <exception>
#include <filesystem>
#include <functional>
#include <list>
#include <memory>
#include <mutex>
#include <unordered_map>
#include <vector>

#include "colmap_graphmatch/base/thread_pool.h"
#include "colmap_graphmatch/base/types.h"
#include "colmap_graphmatch/matching/top_two.h"

namespace colmap_graphmatch {

// What matching needs of one image: num x 128 descriptors, row-major, and, if somebody asks where
// matches are, num x 2 positions (x, y) in pixels.
struct MatchingFeatures {
  std::vector<std::uint8_t> descriptors;
  std::vector<float> positions = {};

  DescriptorView View() const { return {descriptors.data(), descriptors.size() / kDescriptorDim}; }
  std::size_t NumBytes() const { return descriptors.size() + positions.size() * sizeof(float); }
};

// Features of the images that were used last, bounded in bytes, read by threads of its own. All
// members are thread-safe.
class DescriptorCache {
 public:
  using Reader = std::function<MatchingFeatures(ImageId)>;

  // max_bytes: of the features kept for reuse; those that somebody holds count on top once they are
  // no longer kept, so that any bound works, 0 included. make_reader is called once on each of the
  // num_readers threads, and what it returns on that thread alone. Where the system gives no thread
  // at all, whoever waits for an image reads it, one at a time.
  DescriptorCache(std::size_t max_bytes, std::size_t num_readers,
                  const std::function<Reader()>& make_reader);
  ~DescriptorCache();
  DescriptorCache(const DescriptorCache&) = delete;
  DescriptorCache& operator=(const DescriptorCache&) = delete;

  // Features that are there or on their way.
  class Handle;

  // Returns at once; the image is read if it is not there.
  Handle Request(ImageId image);

  // Waits until the features are there. They stay as long as the handle does. Rethrows what the
  // reader threw; the next request for the image tries again.
  const MatchingFeatures& Wait(const Handle& handle);

  // Images read so far.
  std::size_t NumReads() const;

 private:
  friend class DescriptorCachePeer;  // Of the tests.

  std::size_t MaxBytesKept() const;  // At a time, so far.
  struct Entry {
    ImageId image = 0;
    bool ready = false;
    MatchingFeatures features;
    std::exception_ptr exception;
  };
  using Entries = std::list<std::shared_ptr<Entry>>;

  void Close();
  void ReadRequested();  // On a thread of its own.
  void Read(Reader* reader, std::shared_ptr<Entry> entry);
  void Keep(const std::shared_ptr<Entry>& entry);

  const std::size_t max_bytes_;
  mutable std::mutex mutex_;
  std::condition_variable requested_;
  std::condition_variable read_;
  Entries kept_;  // The one used last in front; entries that are not ready are among them.
  std::unordered_map<ImageId, Entries::iterator> places_;
  std::deque<std::shared_ptr<Entry>> to_read_;
  std::size_t bytes_kept_ = 0;
  std::size_t max_bytes_kept_ = 0;
  std::size_t num_reads_ = 0;
  bool closing_ = false;
  const std::function<Reader()> make_reader_;
  std::mutex reading_;  // Of the reader of those that wait.
  Reader reader_;
  std::unique_ptr<ThreadGroup> threads_;

 public:
  class Handle {
   private:
    friend class DescriptorCache;
    std::shared_ptr<Entry> entry_;
  };
};

// A quarter of the memory that this process may use: the machine's, or less if its control group
// or one around it is limited further. In bytes.
std::size_t DefaultCacheBytes();

// The least memory limit of the control groups that groups_path lists (/proc/self/cgroup; version 1
// or 2), whose files are under groups_root; the greatest number if there is none.
std::size_t MemoryLimit(const std::filesystem::path& groups_path,
                        const std::filesystem::path& groups_root);

}  // namespace colmap_graphmatch
