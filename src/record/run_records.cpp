#include "crackle/record/run_records.hpp"

#include <algorithm>
#include <charconv>
#include <ctime>
#include <utility>

#include "crackle/base/error.hpp"
#include "crackle/base/hdf5_handle.hpp"
#include "crackle/base/version.hpp"
#include "crackle/network/network_file.hpp"
#include "crackle/record/part.hpp"
#include "crackle/record/record_check.hpp"
#include "crackle/record/rows.hpp"

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

void write_samples(hid_t file, std::span<const SampleRecord> records) {
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
  RecordOptions found{.parts = {}, .network = hdf5::exists(file, "network")};
  for (const RecordPart* part : record_parts()) {
    if (hdf5::exists(file, part->group)) found.parts.insert(part->name);
  }
  return found;
}

/// The parts of a file, which must be those at least that its options ask for.
RecordFacts find_facts(hid_t file) {
  const RunHeader header = read_head(file);
  RecordFacts facts{.bonds = header.bonds,
                    .displacements = static_cast<std::int64_t>(header.nodes) * header.components,
                    .record = find_parts(file)};
  const std::string asked = "," + option_value(header.options, "-record") + ",";
  for (const RecordPart* part : record_parts()) {
    const bool wanted = asked.find("," + std::string(part->name) + ",") != std::string::npos;
    if (!wanted || facts.record.has(part->name)) continue;
    throw InputError(std::string("group /") + part->group, "", "present: -record asks for it");
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
  for (const RecordPart* part : record_parts()) {
    if (facts.record.has(part->name)) part->read(file, records);
  }
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
  write_samples(file, records);
  for (const RecordPart* part : record_parts()) {
    if (record.has(part->name)) part->write(file, records);
  }
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
