#include "crackle/run_records.hpp"

#include <algorithm>
#include <ctime>

#include "crackle/error.hpp"
#include "crackle/hdf5_handle.hpp"
#include "crackle/network_file.hpp"
#include "crackle/version.hpp"

namespace crackle {

namespace {

std::string now() {
  const std::time_t seconds = std::time(nullptr);
  std::tm utc{};
  gmtime_r(&seconds, &utc);
  std::string text(32, '\0');
  text.resize(std::strftime(text.data(), text.size(), "%Y-%m-%dT%H:%M:%SZ", &utc));
  return text;
}

/// One dataset of a number that every record has.
template <class T, class Get>
void write_each(hid_t where, const std::string& name, std::span<const SampleRecord> records, Get get) {
  std::vector<T> values;
  values.reserve(records.size());
  for (const SampleRecord& record : records) values.push_back(get(record));
  hdf5::write<T>(where, name, values);
}

/// One dataset of the vectors that every record has, end to end.
template <class T>
void write_joined(hid_t where, const std::string& name, std::span<const SampleRecord> records,
                  std::vector<T> SampleRecord::*part, std::size_t columns = 0) {
  std::vector<T> values;
  for (const SampleRecord& record : records) {
    values.insert(values.end(), (record.*part).begin(), (record.*part).end());
  }
  hdf5::write<T>(where, name, values, columns);
}

void write_samples(hid_t file, const RecordOptions& options, std::span<const SampleRecord> records) {
  const hdf5::Handle group = hdf5::create_group(file, "samples");
  const auto number = [&](const std::string& name, double SampleSummary::*field) {
    write_each<double>(group, name, records, [field](const SampleRecord& r) { return r.summary.*field; });
  };
  const auto count = [&](const std::string& name, std::int32_t SampleSummary::*field) {
    write_each<std::int32_t>(group, name, records,
                             [field](const SampleRecord& r) { return r.summary.*field; });
  };
  write_each<std::int64_t>(group, "index", records, [](const SampleRecord& r) { return r.summary.index; });
  number("peak_load", &SampleSummary::peak_load);
  number("peak_displacement", &SampleSummary::peak_displacement);
  number("initial_stiffness", &SampleSummary::initial_stiffness);
  number("wall_time", &SampleSummary::wall_time);
  count("n_p", &SampleSummary::n_p);
  count("n_f", &SampleSummary::n_f);
  if (!options.breaks) return;
  std::vector<std::int64_t> offset{0};
  for (const SampleRecord& record : records) offset.push_back(offset.back() + std::ssize(record.bond));
  hdf5::write<std::int64_t>(group, "break_offset", offset);
  const hdf5::Handle breaks = hdf5::create_group(file, "breaks");
  write_joined(breaks, "bond", records, &SampleRecord::bond);
  write_joined(breaks, "load", records, &SampleRecord::load);
  write_joined(breaks, "stiffness", records, &SampleRecord::stiffness);
}

void write_profiles(hid_t file, std::span<const SampleRecord> records) {
  const hdf5::Handle group = hdf5::create_group(file, "profile");
  const std::size_t sections = records.empty() ? 1 : records.front().profile_peak.size();
  write_joined(group, "peak", records, &SampleRecord::profile_peak, sections);
  write_joined(group, "failure", records, &SampleRecord::profile_failure, sections);
}

void write_snapshots(hid_t file, std::span<const SampleRecord> records) {
  const hdf5::Handle group = hdf5::create_group(file, "snapshots");
  std::vector<std::int64_t> sample;
  std::vector<std::int32_t> number;
  std::vector<double> displacement;
  std::vector<double> force;
  for (const SampleRecord& record : records) {
    for (const Snapshot& snapshot : record.snapshots) {
      sample.push_back(record.summary.index);
      number.push_back(snapshot.number);
      displacement.insert(displacement.end(), snapshot.displacement.begin(), snapshot.displacement.end());
      force.insert(force.end(), snapshot.force.begin(), snapshot.force.end());
    }
  }
  hdf5::write<std::int64_t>(group, "sample", sample);
  hdf5::write<std::int32_t>(group, "number", number);
  hdf5::write<double>(group, "displacement", displacement,
                      sample.empty() ? 1 : displacement.size() / sample.size());
  hdf5::write<double>(group, "force", force, sample.empty() ? 1 : force.size() / sample.size());
}

void read_breaks(hid_t file, std::vector<SampleRecord>& records) {
  const auto offset = hdf5::read<std::int64_t>(file, "samples/break_offset");
  const auto bond = hdf5::read<std::int32_t>(file, "breaks/bond");
  const auto load = hdf5::read<double>(file, "breaks/load");
  const auto stiffness = hdf5::read<double>(file, "breaks/stiffness");
  const auto all = std::min({bond.size(), load.size(), stiffness.size()});
  const bool whole =
      offset.size() == records.size() + 1 && offset.front() == 0 && std::ranges::is_sorted(offset);
  if (!whole || static_cast<std::size_t>(offset.back()) != all) {
    throw InputError("dataset /samples/break_offset", "", "S + 1 places in /breaks");
  }
  for (std::size_t s = 0; s < records.size(); ++s) {
    records[s].bond.assign(bond.begin() + offset[s], bond.begin() + offset[s + 1]);
    records[s].load.assign(load.begin() + offset[s], load.begin() + offset[s + 1]);
    records[s].stiffness.assign(stiffness.begin() + offset[s], stiffness.begin() + offset[s + 1]);
  }
}

void read_profiles(hid_t file, std::vector<SampleRecord>& records) {
  const auto peak = hdf5::read<std::int32_t>(file, "profile/peak");
  const auto failure = hdf5::read<std::int32_t>(file, "profile/failure");
  if (peak.size() != failure.size() || (!records.empty() && peak.size() % records.size() != 0)) {
    throw InputError("size of /profile/peak and failure", "", "a row for each sample");
  }
  const std::ptrdiff_t sections = records.empty() ? 0 : std::ssize(peak) / std::ssize(records);
  for (std::ptrdiff_t s = 0; s < std::ssize(records); ++s) {
    records[s].profile_peak.assign(peak.begin() + s * sections, peak.begin() + (s + 1) * sections);
    records[s].profile_failure.assign(failure.begin() + s * sections, failure.begin() + (s + 1) * sections);
  }
}

void read_snapshots(hid_t file, std::vector<SampleRecord>& records) {
  const auto sample = hdf5::read<std::int64_t>(file, "snapshots/sample");
  const auto number = hdf5::read<std::int32_t>(file, "snapshots/number");
  const auto displacement = hdf5::read<double>(file, "snapshots/displacement");
  const auto force = hdf5::read<double>(file, "snapshots/force");
  const auto count = std::ssize(sample);
  const auto fits = [count](std::ptrdiff_t size) { return count == 0 ? size == 0 : size % count == 0; };
  if (std::ssize(number) != count || !fits(std::ssize(displacement)) || !fits(std::ssize(force))) {
    throw InputError("sizes of /snapshots", "", "as many as /snapshots/sample has");
  }
  const auto part = [count](const std::vector<double>& values, std::ptrdiff_t i) {
    const std::ptrdiff_t width = std::ssize(values) / count;
    return std::vector<double>(values.begin() + i * width, values.begin() + (i + 1) * width);
  };
  for (std::ptrdiff_t i = 0; i < count; ++i) {
    const auto owner = std::ranges::find(records, sample[i], [](const auto& r) { return r.summary.index; });
    if (owner == records.end()) throw InputError("dataset /snapshots/sample", "", "samples of the file");
    owner->snapshots.push_back({number[i], part(displacement, i), part(force, i)});
  }
}

std::vector<SampleRecord> read_file(hid_t file) {
  const auto index = hdf5::read<std::int64_t>(file, "samples/index");
  std::vector<SampleRecord> records(index.size());
  const auto fill = [&](const std::string& name, auto SampleSummary::*field) {
    using T = std::remove_reference_t<decltype(records[0].summary.*field)>;
    const auto values = hdf5::read<T>(file, "samples/" + name);
    if (values.size() != records.size()) throw InputError("size of /samples/" + name, "", "that of index");
    for (std::size_t s = 0; s < records.size(); ++s) records[s].summary.*field = values[s];
  };
  fill("index", &SampleSummary::index);
  fill("peak_load", &SampleSummary::peak_load);
  fill("peak_displacement", &SampleSummary::peak_displacement);
  fill("initial_stiffness", &SampleSummary::initial_stiffness);
  fill("wall_time", &SampleSummary::wall_time);
  fill("n_p", &SampleSummary::n_p);
  fill("n_f", &SampleSummary::n_f);
  if (hdf5::exists(file, "breaks")) read_breaks(file, records);
  if (hdf5::exists(file, "profile")) read_profiles(file, records);
  if (hdf5::exists(file, "snapshots")) read_snapshots(file, records);
  return records;
}

}  // namespace

void write_run(const std::string& path, const RunHeader& header, const RecordOptions& record,
               std::span<const SampleRecord> records) {
  hdf5::Handle file = hdf5::create_file(path);
  hdf5::write_attribute(file, "schema_version", kSchemaVersion);
  hdf5::write_attribute(file, "code_version", std::string(kVersion));
  hdf5::write_attribute(file, "options", header.options);
  hdf5::write_attribute(file, "created", now());
  if (!header.checksum.empty()) hdf5::write_attribute(file, "network_checksum", header.checksum);
  write_samples(file, record, records);
  if (record.profile) write_profiles(file, records);
  if (record.snapshot) write_snapshots(file, records);
  // thresholds belong to one sample
  const std::span<const double> threshold = header.threshold;
  if (record.network)
    write_network(file, *header.network, threshold.first(records.size() <= 1 ? threshold.size() : 0));
  hdf5::close_written(std::move(file), path);
}

namespace {

/// read(file), its complaints with the file's name.
template <class Read>
auto read_from(const std::string& path, Read read) {
  const hdf5::Handle file = hdf5::open_file(path);
  try {
    return read(file);
  } catch (const InputError& error) {
    throw InputError("run file " + path + ": " + error.what());
  }
}

}  // namespace

std::vector<SampleRecord> read_records(const std::string& path) {
  return read_from(path, [](hid_t file) { return read_file(file); });
}

std::string read_options_text(const std::string& path) {
  return read_from(path, [](hid_t file) { return hdf5::read_text(file, "options"); });
}

std::string read_checksum(const std::string& path) {
  return read_from(path, [](hid_t file) {
    return H5Aexists(file, "network_checksum") > 0 ? hdf5::read_text(file, "network_checksum") : "";
  });
}

}  // namespace crackle
