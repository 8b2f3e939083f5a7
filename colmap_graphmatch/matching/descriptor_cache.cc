#include "colmap_graphmatch/matching/descriptor_cache.h"

#include <unistd.h>

#include <algorithm>
#include <fstream>
#include <string>
#include <utility>

namespace colmap_graphmatch {

DescriptorCache::DescriptorCache(std::size_t max_bytes, std::size_t num_readers,
                                 const std::function<Reader()>& make_reader)
    : max_bytes_(max_bytes) {
  for (std::size_t i = 0; i < num_readers; ++i) {
    threads_.emplace_back([this, make_reader] { Read(make_reader); });
  }
}

DescriptorCache::~DescriptorCache() {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    closing_ = true;
    requested_.notify_all();
  }
  for (std::thread& thread : threads_) thread.join();
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

void DescriptorCache::Read(const std::function<Reader()>& make_reader) {
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
    MatchingFeatures features;
    std::exception_ptr exception;
    try {
      if (!reader) reader = make_reader();
      features = reader(entry->image);
    } catch (...) {
      exception = std::current_exception();
    }
    const std::lock_guard<std::mutex> lock(mutex_);
    ++num_reads_;
    entry->features = std::move(features);
    entry->exception = exception;
    entry->ready = true;
    Keep(entry);
    read_.notify_all();
  }
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

std::size_t DefaultCacheBytes() {
  const long num_pages = ::sysconf(_SC_PHYS_PAGES);
  const long page_size = ::sysconf(_SC_PAGESIZE);
  std::size_t bytes = static_cast<std::size_t>(std::max(num_pages, 1L)) *
                      static_cast<std::size_t>(std::max(page_size, 1L));
  // The line of the unified hierarchy, "0::/path", and the limits from there up.
  std::ifstream groups("/proc/self/cgroup");
  for (std::string line; std::getline(groups, line);) {
    if (line.rfind("0::/", 0) != 0) continue;
    std::string group = line.substr(3);
    while (!group.empty()) {
      std::size_t limit = 0;
      // "max", which is no number, stands for no limit.
      if (std::ifstream("/sys/fs/cgroup" + group + "/memory.max") >> limit) {
        bytes = std::min(bytes, limit);
      }
      group.resize(group.find_last_of('/'));
    }
  }
  return bytes / 4;
}

}  // namespace colmap_graphmatch
