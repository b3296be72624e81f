#include "crackle/record/run_records.hpp"

#include <algorithm>
#include <charconv>
#include <ctime>
#include <unordered_map>
#include <utility>

#include "crackle/base/error.hpp"
#include "crackle/base/hdf5_handle.hpp"
#include "crackle/base/version.hpp"
#include "crackle/network/network_file.hpp"
#include "crackle/record/record_check.hpp"

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

/// A dataset of one value for each of `rows`, or with columns != nullptr of a row of as many each.
template <class T>
std::vector<T> read_rows(hid_t file, const std::string& name, std::size_t rows,
                         std::size_t* columns = nullptr) {
  std::vector<hsize_t> shape;
  std::vector<T> values = hdf5::read<T>(file, name, &shape);
  if (shape.size() != (columns == nullptr ? 1 : 2) || shape[0] != rows) {
    throw InputError("shape of dataset /" + name, "",
                     "[" + std::to_string(rows) + "]" + (columns == nullptr ? "" : "[..]"));
  }
  if (columns != nullptr) *columns = static_cast<std::size_t>(shape[1]);
  return values;
}

/// The values that belong to one row.
template <class T>
std::vector<T> row_of(const std::vector<T>& values, std::size_t row, std::size_t columns) {
  const auto begin = values.begin() + static_cast<std::ptrdiff_t>(row * columns);
  return {begin, begin + static_cast<std::ptrdiff_t>(columns)};
}

void read_breaks(hid_t file, std::vector<SampleRecord>& records) {
  const auto offset = read_rows<std::int64_t>(file, "samples/break_offset", records.size() + 1);
  std::vector<hsize_t> shape;
  const auto bond = hdf5::read<std::int32_t>(file, "breaks/bond", &shape);
  if (shape.size() != 1) throw InputError("shape of dataset /breaks/bond", "", "[B]");
  if (offset.front() != 0 || !std::ranges::is_sorted(offset) || offset.back() != std::ssize(bond)) {
    throw InputError("dataset /samples/break_offset", "",
                     "ascending places in /breaks, from 0 to " + std::to_string(bond.size()));
  }
  const auto load = read_rows<double>(file, "breaks/load", bond.size());
  const auto stiffness = read_rows<double>(file, "breaks/stiffness", bond.size());
  for (std::size_t s = 0; s < records.size(); ++s) {
    records[s].bond.assign(bond.begin() + offset[s], bond.begin() + offset[s + 1]);
    records[s].load.assign(load.begin() + offset[s], load.begin() + offset[s + 1]);
    records[s].stiffness.assign(stiffness.begin() + offset[s], stiffness.begin() + offset[s + 1]);
  }
}

void read_profiles(hid_t file, std::vector<SampleRecord>& records) {
  std::size_t sections = 0;
  const auto peak = read_rows<std::int32_t>(file, "profile/peak", records.size(), &sections);
  std::size_t same = 0;
  const auto failure = read_rows<std::int32_t>(file, "profile/failure", records.size(), &same);
  if (same != sections) throw InputError("columns of /profile/failure", "", "those of /profile/peak");
  for (std::size_t s = 0; s < records.size(); ++s) {
    records[s].profile_peak = row_of(peak, s, sections);
    records[s].profile_failure = row_of(failure, s, sections);
  }
}

void read_snapshots(hid_t file, std::vector<SampleRecord>& records) {
  const auto sample = hdf5::read<std::int64_t>(file, "snapshots/sample");
  std::size_t displacements = 0;
  std::size_t forces = 0;
  const auto number = read_rows<std::int32_t>(file, "snapshots/number", sample.size());
  const auto displacement = read_rows<double>(file, "snapshots/displacement", sample.size(), &displacements);
  const auto force = read_rows<double>(file, "snapshots/force", sample.size(), &forces);
  std::unordered_map<std::int64_t, SampleRecord*> owner;
  for (SampleRecord& record : records) owner[record.summary.index] = &record;
  for (std::size_t i = 0; i < sample.size(); ++i) {
    const auto found = owner.find(sample[i]);
    if (found == owner.end()) {
      throw InputError("dataset /snapshots/sample", std::to_string(sample[i]), "numbers in /samples/index");
    }
    found->second->snapshots.push_back(
        {number[i], row_of(displacement, i, displacements), row_of(force, i, forces)});
  }
}

/// The numbers of a list with commas between; none where there is no list.
std::vector<std::int32_t> numbers_of(const std::string& list) {
  std::vector<std::int32_t> numbers;
  const char* at = list.data();
  const char* const end = at + list.size();
  for (std::int32_t number = 0; at < end;) {
    const auto [stop, error] = std::from_chars(at, end, number);
    if (error != std::errc{}) return {};
    numbers.push_back(number);
    at = stop + 1;
  }
  return numbers;
}

void check_schema(hid_t file) {
  const double version = hdf5::read_number(file, "schema_version");
  if (version == kSchemaVersion) return;
  throw InputError("schema_version", std::to_string(static_cast<std::int64_t>(version)),
                   std::to_string(kSchemaVersion) + ", that of crackle " + kVersion);
}

RunHeader read_head(hid_t file) {
  check_schema(file);
  RunHeader header;
  header.options = hdf5::read_text(file, "options");
  std::istringstream deciding(hdf5::read_text(file, "deciding_options"));
  for (std::string name; std::getline(deciding, name);) header.deciding.push_back(name);
  if (hdf5::has_attribute(file, "network_checksum")) {
    header.checksum = hdf5::read_text(file, "network_checksum");
  }
  for (const auto& [name, count] :
       {std::pair{"nodes", &header.nodes}, std::pair{"components", &header.components},
        std::pair{"bonds", &header.bonds}}) {
    if (!hdf5::has_attribute(file, name)) continue;
    *count = static_cast<std::int32_t>(std::clamp(hdf5::read_number(file, name), 0.0, 0x1p31 - 1));
  }
  return header;
}

RecordOptions find_parts(hid_t file) {
  return {.breaks = hdf5::exists(file, "breaks"),
          .profile = hdf5::exists(file, "profile"),
          .snapshot = hdf5::exists(file, "snapshots"),
          .network = hdf5::exists(file, "network")};
}

/// The parts of a file, which must be those at least that its options ask for.
RecordFacts find_facts(hid_t file) {
  const RunHeader header = read_head(file);
  RecordFacts facts{.bonds = header.bonds,
                    .displacements = static_cast<std::int64_t>(header.nodes) * header.components,
                    .record = find_parts(file)};
  const std::string asked = "," + option_value(header.options, "-record") + ",";
  for (const auto& [word, group, there] : {std::tuple{",breaks,", "/breaks", facts.record.breaks},
                                           {",profile,", "/profile", facts.record.profile},
                                           {",snapshot,", "/snapshots", facts.record.snapshot}}) {
    if (asked.find(word) != std::string::npos && !there) {
      throw InputError(std::string("group ") + group, "", "present: -record asks for it");
    }
  }
  facts.record.snapshot_at = numbers_of(option_value(header.options, "-record_snapshot_at"));
  return facts;
}

std::vector<SampleRecord> read_file(hid_t file) {
  const RecordFacts facts = find_facts(file);
  std::vector<hsize_t> shape;
  const auto index = hdf5::read<std::int64_t>(file, "samples/index", &shape);
  if (shape.size() != 1) throw InputError("shape of dataset /samples/index", "", "[S]");
  std::vector<SampleRecord> records(index.size());
  const auto fill = [&](const std::string& name, auto SampleSummary::*field) {
    using T = std::remove_reference_t<decltype(records[0].summary.*field)>;
    const auto values = read_rows<T>(file, "samples/" + name, records.size());
    for (std::size_t s = 0; s < records.size(); ++s) records[s].summary.*field = values[s];
  };
  fill("index", &SampleSummary::index);
  fill("peak_load", &SampleSummary::peak_load);
  fill("peak_displacement", &SampleSummary::peak_displacement);
  fill("initial_stiffness", &SampleSummary::initial_stiffness);
  fill("wall_time", &SampleSummary::wall_time);
  fill("n_p", &SampleSummary::n_p);
  fill("n_f", &SampleSummary::n_f);
  check_numbers(index);
  if (facts.record.breaks) read_breaks(file, records);
  if (facts.record.profile) read_profiles(file, records);
  if (facts.record.snapshot) read_snapshots(file, records);
  check_records(records, facts);
  return records;
}

void write_head(hid_t file, const RunHeader& header) {
  hdf5::write_attribute(file, "schema_version", kSchemaVersion);
  hdf5::write_attribute(file, "code_version", std::string(kVersion));
  hdf5::write_attribute(file, "options", header.options);
  std::string deciding;
  for (const std::string& name : header.deciding) deciding += name + "\n";
  hdf5::write_attribute(file, "deciding_options", deciding);
  hdf5::write_attribute(file, "created", now());
  for (const auto& [name, count] :
       {std::pair{"nodes", header.nodes}, std::pair{"components", header.components},
        std::pair{"bonds", header.bonds}}) {
    if (count > 0) hdf5::write_attribute(file, name, count);
  }
  if (!header.checksum.empty()) hdf5::write_attribute(file, "network_checksum", header.checksum);
}

void write_parts(hid_t file, const RecordOptions& record, std::span<const SampleRecord> records) {
  write_samples(file, record, records);
  if (record.profile) write_profiles(file, records);
  if (record.snapshot) write_snapshots(file, records);
}

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

bool is_table(hid_t file, const char* name) {
  const hdf5::Handle dataset(hdf5::checked(H5Dopen2(file, name, H5P_DEFAULT), "open thresholds"));
  const hdf5::Handle space(hdf5::checked(H5Dget_space(dataset), "ask for a shape"));
  return H5Sget_simple_extent_ndims(space) == 2;
}

/// One row of thresholds belongs to one sample; a row for each number stays.
void copy_network(hid_t from, hid_t to, bool one_sample) {
  hdf5::checked(H5Ocopy(from, "network", to, "network", H5P_DEFAULT, H5P_DEFAULT), "copy /network");
  const char* const threshold = "network/bonds/threshold";
  if (!one_sample && hdf5::exists(to, threshold) && !is_table(to, threshold)) {
    hdf5::checked(H5Ldelete(to, threshold, H5P_DEFAULT), "leave out thresholds");
  }
}

}  // namespace

Bytes format_run(const RunHeader& header, const RecordOptions& record,
                 std::span<const SampleRecord> records) {
  hdf5::NewFile file;
  write_head(file, header);
  write_parts(file, record, records);
  const std::span<const double> threshold = header.threshold;
  if (record.network) {
    const bool kept = records.size() <= 1 || std::cmp_greater(threshold.size(), header.bonds);
    write_network(file, *header.network, threshold.first(kept ? threshold.size() : 0));
  }
  return file.finish();
}

Bytes format_run(const RunHeader& header, const RecordOptions& record, std::span<const SampleRecord> records,
                 const std::string& network_from) {
  (void)read_network_file(network_from);  // a copy alone would pass on what is damaged
  return read_from(network_from, [&](hid_t source) {
    hdf5::NewFile file;
    write_head(file, header);
    write_parts(file, record, records);
    copy_network(source, file, records.size() <= 1);
    return file.finish();
  });
}

std::vector<SampleRecord> read_records(const std::string& path) {
  return read_from(path, [](hid_t file) { return read_file(file); });
}

RunHeader read_header(const std::string& path) {
  return read_from(path, [](hid_t file) { return read_head(file); });
}

RecordOptions read_parts(const std::string& path) {
  return read_from(path, [](hid_t file) { return find_parts(file); });
}

}  // namespace crackle
