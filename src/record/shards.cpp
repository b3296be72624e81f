#include "crackle/record/shards.hpp"

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <utility>

#include "crackle/base/error.hpp"

namespace crackle {

namespace fs = std::filesystem;

namespace {

std::vector<std::string> paths_ending(const std::string& output, const char* extension) {
  std::vector<std::string> paths;
  const std::string folder = shard_folder(output);
  if (!fs::is_directory(folder)) return paths;
  for (const auto& entry : fs::directory_iterator(folder)) {
    if (is_ours(entry.path().string(), extension)) paths.push_back(entry.path().string());
  }
  std::ranges::sort(paths);
  return paths;
}

std::int64_t index_of(const SampleRecord& record) {
  return record.summary.index;
}

void write_shard(const std::string& path, std::span<const std::byte> content) {
  write_for_run(path, path + ".part", content);
}

}  // namespace

std::vector<std::string> shard_paths(const std::string& output) {
  return paths_ending(output, ".h5");
}

std::vector<std::string> checkpoint_paths(const std::string& output) {
  return paths_ending(output, kCheckpoint);
}

std::string checkpoint_path(const std::string& output, std::int64_t sample) {
  return shard_folder(output) + "/" + std::to_string(sample) + kCheckpoint;
}

void write_for_run(const std::string& path, const std::string& temporary,
                   std::span<const std::byte> content) {
  try {
    write_durably(path, temporary, content);
  } catch (const WriteError& error) {
    throw WriteError(path, error.reason() + "; what was written before is kept, -resume goes on");
  }
}

ShardWriter::ShardWriter(std::string output, const RunHeader& header, const RecordOptions& record, int first,
                         int step)
    : output_(std::move(output)),
      header_(header),
      record_(record),
      number_(first),
      step_(step),
      last_flush_(std::chrono::steady_clock::now()) {}

void ShardWriter::add(SampleRecord record) {
  waiting_.push_back(std::move(record));
}

bool ShardWriter::due() const {
  const std::chrono::duration<double> age = std::chrono::steady_clock::now() - last_flush_;
  return !waiting_.empty() && age.count() >= kFlushSeconds;
}

/// Numbers of an earlier run, whose processes may have been fewer or more, are left to it.
std::string ShardWriter::next_path() {
  while (true) {
    std::string path = shard_folder(output_) + "/" + std::to_string(number_) + ".h5";
    number_ += step_;
    if (!fs::exists(path)) return path;
  }
}

void ShardWriter::flush() {
  last_flush_ = std::chrono::steady_clock::now();
  if (waiting_.empty()) return;
  std::ranges::sort(waiting_, {}, index_of);
  const std::string path = next_path();
  write_shard(path, format_run(header_, record_, waiting_));
  for (const SampleRecord& record : waiting_)
    std::remove(checkpoint_path(output_, record.summary.index).c_str());
  waiting_.clear();
  own_.push_back(path);
  if (std::ssize(own_) == kShardsTogether) gather();
}

/// A long run would leave a file a second. A kill between the two steps leaves samples twice: they are the same.
void ShardWriter::gather() {
  std::vector<SampleRecord> records;
  for (const std::string& path : own_) {
    for (SampleRecord& record : read_records(path)) records.push_back(std::move(record));
  }
  std::ranges::sort(records, {}, index_of);
  write_shard(next_path(), format_run(header_, record_, records));
  for (const std::string& path : own_) std::remove(path.c_str());
  own_.clear();
}

void ShardWriter::write_checkpoint(const SampleRecord& begun) const {
  RecordOptions record = record_;
  record.parts.insert("breaks");
  record.network = false;
  write_shard(checkpoint_path(output_, begun.summary.index), format_run(header_, record, {&begun, 1}));
}

std::optional<SampleRecord> ShardWriter::read_checkpoint(std::int64_t sample, BondId bonds) const {
  const std::string path = checkpoint_path(output_, sample);
  if (!fs::exists(path)) return std::nullopt;
  std::vector<SampleRecord> records = read_records(path);
  const auto broken = [&] { return std::span(records.front().bond); };
  const bool one = records.size() == 1 && records.front().summary.index == sample;
  if (!one || std::ssize(broken()) != records.front().summary.n_f ||
      !std::ranges::all_of(broken(), [bonds](BondId e) { return e >= 0 && e < bonds; })) {
    throw InputError("checkpoint " + path, "",
                     "sample " + std::to_string(sample) + " with all of its breaks");
  }
  return std::move(records.front());
}

}  // namespace crackle
