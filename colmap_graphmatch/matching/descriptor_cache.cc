#include "colmap_graphmatch/matching/descriptor_cache.h"

#include <unistd.h>

#include <algorithm>
#include <fstream>
#include <limits>
#include <string>
#include <utility>

namespace colmap_graphmatch {

DescriptorCache::DescriptorCache(std::size_t max_bytes, std::size_t num_readers,
                                 const std::function<Reader()>& make_reader)
    : max_bytes_(max_bytes), make_reader_(make_reader) {
  threads_ = std::make_unique<ThreadGroup>(num_readers, [this] { ReadRequested(); });
}

DescriptorCache::~DescriptorCache() { Close(); }

void DescriptorCache::Close() {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    closing_ = true;
    requested_.notify_all();
  }
  threads_->Join();
}

DescriptorCache::Handle DescriptorCache::Request(ImageId image) {
  const std::lock_guard<std::mutex> lock(mutex_);
  Handle handle;
  const auto place = places_.find(image);
  if (place != places_.end()) {
    kept_.splice(kept_.begin(), kept_, place->second);
    handle.entry_ = kept_.front();
    return handle;
  }
  handle.entry_ = std::make_shared<Entry>();
  handle.entry_->image = image;
  kept_.push_front(handle.entry_);
  places_[image] = kept_.begin();
  to_read_.push_back(handle.entry_);
  requested_.notify_one();
  return handle;
}

const MatchingFeatures& DescriptorCache::Wait(const Handle& handle) {
  const Entry& entry = *handle.entry_;
  if (threads_->Size() == 0) {
    const std::lock_guard<std::mutex> reading(reading_);
    while (true) {
      std::shared_ptr<Entry> next;
      {
        const std::lock_guard<std::mutex> lock(mutex_);
        if (entry.ready || to_read_.empty()) break;
        next = std::move(to_read_.front());
        to_read_.pop_front();
      }
      Read(&reader_, std::move(next));
    }
  }
  std::unique_lock<std::mutex> lock(mutex_);
  read_.wait(lock, [&] { return entry.ready; });
  if (entry.exception) std::rethrow_exception(entry.exception);
  return entry.features;
}

std::size_t DescriptorCache::NumReads() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return num_reads_;
}

std::size_t DescriptorCache::MaxBytesKept() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return max_bytes_kept_;
}

void DescriptorCache::ReadRequested() {
  Reader reader;
  while (true) {
    std::shared_ptr<Entry> entry;
    {
      std::unique_lock<std::mutex> lock(mutex_);
      requested_.wait(lock, [&] { return closing_ || !to_read_.empty(); });
      if (closing_) return;
      entry = std::move(to_read_.front());
      to_read_.pop_front();
    }
    Read(&reader, std::move(entry));
  }
}

void DescriptorCache::Read(Reader* reader, std::shared_ptr<Entry> entry) {
  MatchingFeatures features;
  std::exception_ptr exception;
  try {
    if (!*reader) *reader = make_reader_();
    features = (*reader)(entry->image);
  } catch (...) {
    exception = std::current_exception();
  }
  const std::lock_guard<std::mutex> lock(mutex_);
  ++num_reads_;
  entry->features = std::move(features);
  entry->exception = std::move(exception);
  entry->ready = true;
  Keep(entry);
  // Whoever waits is the last to hold it: an exception is not to end on this thread while it is
  // being read on another.
  entry.reset();
  read_.notify_all();
}

void DescriptorCache::Keep(const std::shared_ptr<Entry>& entry) {
  if (entry->exception) {
    const auto place = places_.find(entry->image);
    kept_.erase(place->second);
    places_.erase(place);
    return;
  }
  bytes_kept_ += entry->features.NumBytes();
  auto oldest = kept_.end();
  while (bytes_kept_ > max_bytes_ && oldest != kept_.begin()) {
    --oldest;
    if (!(*oldest)->ready) continue;
    bytes_kept_ -= (*oldest)->features.NumBytes();
    places_.erase((*oldest)->image);
    oldest = kept_.erase(oldest);
  }
  max_bytes_kept_ = std::max(max_bytes_kept_, bytes_kept_);
}

std::size_t MemoryLimit(const std::filesystem::path& groups_path,
                        const std::filesystem::path& groups_root) {
  std::size_t bytes = std::numeric_limits<std::size_t>::max();
  // "max", which is no number, stands for no limit.
  const auto limit_by = [&](const std::filesystem::path& path) {
    std::size_t limit = 0;
    if (std::ifstream(path) >> limit) bytes = std::min(bytes, limit);
  };
  limit_by(groups_root / "memory.max");
  limit_by(groups_root / "memory/memory.limit_in_bytes");
  // "0::/path" in version 2, "9:memory:/path" in version 1; limits of the groups around it hold
  // too.
  std::ifstream groups(groups_path);
  for (std::string line; std::getline(groups, line);) {
    const std::size_t first = line.find(':');
    const std::size_t second = line.find(':', first + 1);
    if (second == std::string::npos) continue;
    const std::string controllers = line.substr(first + 1, second - first - 1);
    std::string group = line.substr(second + 1);
    while (group.size() > 1 && group.front() == '/') {
      if (controllers.empty()) limit_by(groups_root.string() + group + "/memory.max");
      if (controllers == "memory") {
        limit_by(groups_root.string() + "/memory" + group + "/memory.limit_in_bytes");
      }
      group.resize(group.find_last_of('/'));
    }
  }
  return bytes;
}

std::size_t DefaultCacheBytes() {
  const long num_pages = ::sysconf(_SC_PHYS_PAGES);
  const long page_size = ::sysconf(_SC_PAGESIZE);
  const std::size_t physical = static_cast<std::size_t>(std::max(num_pages, 1L)) *
                               static_cast<std::size_t>(std::max(page_size, 1L));
  return std::min(physical, MemoryLimit("/proc/self/cgroup", "/sys/fs/cgroup")) / 4;
}

}  // namespace colmap_graphmatch
