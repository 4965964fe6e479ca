// Feeds structurally changed models, scenarios, studies and their results, papers, meshes,
// archives, URDF, MJCF and SDF files and tables to the whole program: it must end by itself with an
// exit code from 0 to 3, in time. (scripts/fuzz_structure)
//   mutate_files --program FILE --source FOLDER --out FOLDER [--count N] [--seed N] [--jobs N]
// Inputs that break this stay in OUT/found; each has its seed, with which it is made again.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <thread>

#include "base/worker_pool.h"
#include "base/zip.h"
#include "tests/fuzz/structure/mutations.h"
#include "tests/support/sanitized.h"

namespace mbv::fuzz {
namespace {

namespace fs = std::filesystem;

struct Options {
  std::string program, source, out;
  size_t count = 200;
  unsigned long seed = 1;
  int jobs = static_cast<int>(std::max(1U, std::thread::hardware_concurrency()));
};

std::string Read(const fs::path& path) {
  std::ifstream stream(path, std::ios::binary);
  return std::string(std::istreambuf_iterator<char>(stream), {});
}

void WriteText(const fs::path& path, const std::string& text) {
  fs::create_directories(path.parent_path());
  std::ofstream(path, std::ios::binary) << text;
}

// With this extension, "" for any.
std::vector<fs::path> FilesBelow(const fs::path& folder, const std::string& extension) {
  std::vector<fs::path> files;
  for (const auto& entry : fs::recursive_directory_iterator(folder)) {
    const bool wanted = extension.empty() || entry.path().extension() == extension;
    if (wanted && entry.is_regular_file()) files.push_back(entry.path());
  }
  std::sort(files.begin(), files.end());
  return files;
}

// A changed file, and what the program is asked to do with it.
struct Input {
  std::vector<std::string> argv;
  fs::path folder;
};

class Maker {
 public:
  explicit Maker(const Options& options) : options_(options) {
    const fs::path source = options.source;
    models_ = FilesBelow(source / "models", ".yaml");
    for (const fs::path& file : FilesBelow(source / "scenarios", ".yaml")) {
      const std::string text = Read(file);
      if (text.find("\nmotion:") != std::string::npos) motions_.push_back(file);
      if (text.find("kind: stiffness") != std::string::npos) stiffness_.push_back(file);
    }
    urdfs_ = FilesBelow(source / "tests/fuzz/seeds/urdf", ".urdf");
    mjcfs_ = FilesBelow(source / "tests/fuzz/seeds/mjcf", ".xml");
    sdfs_ = FilesBelow(source / "tests/fuzz/seeds/sdf", ".sdf");
    tables_ = FilesBelow(source / "scenarios", ".csv");
    for (const fs::path& file : FilesBelow(source / "scenarios", ".yaml")) {
      if (file.filename().string().starts_with("study_")) studies_.push_back(file);
    }
    for (const fs::path& file : models_) {
      if (file.filename() == "paper.yaml") papers_.push_back(file);
    }
    MakeResults();
  }

  [[nodiscard]] const std::string& trouble() const { return trouble_; }

  // The k-th input; it depends on the seed and k alone.
  [[nodiscard]] Input Make(size_t k) const {
    Random random(options_.seed * 1000003UL + k);
    Input input;
    input.folder = fs::path(options_.out) / "work" / std::to_string(k);
    switch (k % 15) {
      case 9:
        Study(&random, &input);
        break;
      case 10:
        StudyResult(&random, &input);
        break;
      case 11:
        Paper(&random, &input);
        break;
      case 12:
        Archive(&random, &input);
        break;
      case 13:
        Mesh(&random, &input);
        break;
      case 14:
        Sdf(&random, &input);
        break;
      case 0:
        Urdf(&random, &input);
        break;
      case 8:
        Mjcf(&random, &input);
        break;
      case 1:
        Table(&random, &input);
        break;
      case 2:
        Stiffness(&random, &input);
        break;
      case 3:
      case 4:
        Model(&random, &input);
        break;
      case 5:
        ModelInScenario(&random, &input);
        break;
      default:
        Motion(&random, &input);
    }
    input.argv.insert(input.argv.begin(), options_.program);
    return input;
  }

 private:
  static const fs::path& OneOf(const std::vector<fs::path>& files, Random* random) {
    return files[static_cast<size_t>((*random)() % files.size())];
  }

  void Model(Random* random, Input* input) const {
    const fs::path seed = OneOf(models_, random);
    const fs::path file = input->folder / seed.filename();
    WriteText(file, MutateYaml(Read(seed), random));
    // Files that it refers to.
    for (const auto& beside : fs::directory_iterator(seed.parent_path())) {
      std::error_code error;
      if (beside.path().extension() == ".xml" || beside.path().filename() == seed.filename())
        continue;
      fs::copy(beside.path(), input->folder / beside.path().filename(), error);
    }
    const std::vector<std::string> format = {"text", "json", "mjcf", "urdf"};
    input->argv = {"model", file.string(), "--format", format[(*random)() % 4]};
  }

  void Motion(Random* random, Input* input) const {
    const fs::path seed = OneOf(motions_, random);
    Short(MutateYaml(Read(seed), random), seed, input);
  }

  // A few samples only: what takes long otherwise is what the file asks for.
  void Short(const std::string& text, const fs::path& seed, Input* input) const {
    const fs::path file = input->folder / seed.filename();
    WriteText(file, text);
    input->argv = {"run",
                   "-q",
                   "--no-pictures",
                   "--out",
                   (input->folder / "out").string(),
                   "--set",
                   "motion.duration_s=0.05",
                   "--set",
                   "motion.sample_s=0.01",
                   "--set",
                   "snapshots.times_s=[]",
                   file.string()};
  }

  void ModelInScenario(Random* random, Input* input) const {
    const fs::path scenario = OneOf(motions_, random);
    const fs::path model =
        fs::path(options_.source) / "models" /
        scenario.lexically_relative(fs::path(options_.source) / "scenarios").begin()->string() /
        "model.yaml";
    if (!fs::exists(model)) return Motion(random, input);
    WriteText(input->folder / "model.yaml", MutateYaml(Read(model), random));
    Short(Read(scenario), scenario, input);
    input->argv.insert(input->argv.begin() + 1,
                       {"--set", "mechanism=" + (input->folder / "model.yaml").string()});
  }

  void Stiffness(Random* random, Input* input) const {
    const fs::path seed = OneOf(stiffness_, random);
    const fs::path file = input->folder / seed.filename();
    WriteText(file, MutateYaml(Read(seed), random));
    input->argv = {"run",        "-q", "--no-pictures", "--out", (input->folder / "out").string(),
                   file.string()};
  }

  void Urdf(Random* random, Input* input) const {
    const fs::path seed = OneOf(urdfs_, random);
    WriteText(input->folder / "robot.urdf", MutateXml(Read(seed), random));
    WriteText(input->folder / "model.yaml", "name: robot\nurdf: robot.urdf\n");
    input->argv = {"model", (input->folder / "model.yaml").string(), "--format", "mjcf"};
  }

  void Mjcf(Random* random, Input* input) const { Robot("robot.xml", mjcfs_, random, input); }
  void Sdf(Random* random, Input* input) const { Robot("robot.sdf", sdfs_, random, input); }

  static void Robot(const char* name, const std::vector<fs::path>& seeds, Random* random,
                    Input* input) {
    const fs::path file = input->folder / name;
    WriteText(file, MutateXml(Read(OneOf(seeds, random)), random));
    input->argv = {"model", file.string(), "--format", (*random)() % 2 == 0 ? "yaml" : "mjcf"};
  }

  void Table(Random* random, Input* input) const {
    const fs::path seed = OneOf(tables_, random);
    const fs::path csv = input->folder / "table.csv";
    WriteText(csv, MutateTable(Read(seed), random));
    // The first scenario that uses the seed.
    for (const fs::path& scenario : motions_) {
      const std::string text = Read(scenario);
      if (text.find(seed.filename().string()) == std::string::npos) continue;
      WriteText(input->folder / scenario.filename(), text);
      input->argv = {"run",
                     "-q",
                     "--no-pictures",
                     "--out",
                     (input->folder / "out").string(),
                     "--set",
                     "reference.csv=" + csv.string(),
                     "--set",
                     "simulation=off",
                     (input->folder / scenario.filename()).string()};
      return;
    }
    Urdf(random, input);
  }

  // Seeds that only the program itself writes: results of a study, and an archive.
  void MakeResults() {
    const fs::path folder = fs::path(options_.out) / "seeds", source = options_.source;
    fs::remove_all(folder);
    fs::create_directories(folder);
    const fs::path study = source / "scenarios/four_bar/study_by_hand.yaml";
    WorkerPool pool;
    pool.timeout_s = 300.0;
    pool.parallel = 1;
    pool.ended = [&](size_t, const WorkerEnd& end) {
      if (end.exit_code != 0) trouble_ = "a seed could not be made: see " + folder.string();
    };
    (void)pool.Run(
        {{{options_.program, "study", study.string(), "--count", "4", "--out",
           (folder / "study").string()},
          folder / "study.txt"},
         {{options_.program, "package", (source / "scenarios/four_bar/turn_inverse.yaml").string(),
           "--no-report", "--no-figures", "--out", (folder / "paper.zip").string()},
          folder / "package.txt"}});
    results_ = folder / "study";
    archive_ = Read(folder / "paper.zip");
    Diagnostics diagnostics;
    ZipFile zip((folder / "paper.zip").string(), {}, &diagnostics);
    for (const ListedEntry& entry : zip.entries()) {
      packed_.push_back({entry.path, "", entry.executable});
      ArchiveEntry& packed = packed_.back();
      (void)zip.Read(entry, [&](std::string_view piece) {
        packed.content += piece;
        return true;
      });
    }
    if (packed_.empty()) trouble_ = "a seed could not be made: see " + folder.string();
  }

  void Study(Random* random, Input* input) const {
    const fs::path seed = OneOf(studies_, random);
    const fs::path file = input->folder / seed.filename();
    WriteText(file, MutateYaml(Read(seed), random));
    if ((*random)() % 2 == 0) {
      input->argv = {"check", file.string()};
      return;
    }
    // The scenario that it varies lies beside it.
    for (const auto& beside : fs::directory_iterator(seed.parent_path())) {
      std::error_code error;
      if (!fs::exists(input->folder / beside.path().filename())) {
        fs::copy(beside.path(), input->folder / beside.path().filename(),
                 fs::copy_options::recursive, error);
      }
    }
    input->argv = {"study",  file.string(), "--count", "2",
                   "--jobs", "1",           "--out",   (input->folder / "out").string()};
  }

  // study.json and points of a study, which --resume and merge read again.
  void StudyResult(Random* random, Input* input) const {
    fs::create_directories(input->folder);
    fs::copy(results_, input->folder / "out", fs::copy_options::recursive);
    const std::vector<fs::path> files = FilesBelow(input->folder / "out", ".json");
    const std::vector<fs::path> points = FilesBelow(input->folder / "out", ".csv");
    const bool json = points.empty() || (*random)() % 4 != 0;
    const fs::path file = OneOf(json ? files : points, random);
    WriteText(file, json ? MutateJson(Read(file), random) : MutateTable(Read(file), random));
    const std::string out = (input->folder / "out").string();
    if ((*random)() % 2 == 0) {
      input->argv = {"study", "merge", (files.front().parent_path()).string(), "--out",
                     (input->folder / "merged").string()};
    } else {
      input->argv = {"study",
                     (fs::path(options_.source) / "scenarios/four_bar/study_by_hand.yaml").string(),
                     "--count",
                     "4",
                     "--resume",
                     "--jobs",
                     "1",
                     "--out",
                     out};
    }
  }

  void Paper(Random* random, Input* input) const {
    const fs::path seed = OneOf(papers_, random);
    for (const auto& beside : fs::directory_iterator(seed.parent_path())) {
      std::error_code error;
      fs::create_directories(input->folder);
      fs::copy(beside.path(), input->folder / beside.path().filename(), error);
    }
    const fs::path file = input->folder / seed.filename();
    WriteText(file, MutateYaml(Read(seed), random));
    input->argv = {"check", file.string()};
  }

  // Bytes of an archive, or a file in it whose checksum then does not fit, or its manifest.
  void Archive(Random* random, Input* input) const {
    const fs::path file = input->folder / "paper.zip";
    std::string bytes = archive_;
    std::string trouble;
    std::vector<ArchiveEntry> entries = packed_;
    if ((*random)() % 4 == 0) {
      bytes = MutateBytes(archive_, random);
    } else {
      ArchiveEntry* entry = &entries[static_cast<size_t>((*random)() % entries.size())];
      for (ArchiveEntry& each : entries) {
        if (each.path.ends_with("manifest.json") && (*random)() % 4 != 0) entry = &each;
      }
      const bool json = entry->path.ends_with(".json");
      entry->content =
          json ? MutateJson(entry->content, random) : MutateBytes(entry->content, random);
      if ((*random)() % 8 == 0) entries.push_back({"four/more.txt", "surplus"});
      bytes = WriteZip(std::move(entries), &trouble).value_or(bytes);
    }
    WriteText(file, bytes);
    input->argv = {"package", "--check", file.string()};
  }

  // A cube in the formats that meshes have, on a body.
  void Mesh(Random* random, Input* input) const {
    const std::vector<fs::path> meshes =
        FilesBelow(fs::path(options_.source) / "tests/fuzz/seeds/mesh", "");
    const fs::path seed = OneOf(meshes, random);
    const std::string name = seed.filename().string();
    const bool text = (*random)() % 2 == 0;
    WriteText(input->folder / name,
              text ? MutateTable(Read(seed), random) : MutateBytes(Read(seed), random));
    WriteText(input->folder / "model.yaml",
              "name: cube\nbodies:\n  arm:\n    mass: 1\n    inertia: [1, 1, 1]\n    shapes:\n"
              "      - {mesh: {file: " +
                  name +
                  "}}\njoints:\n  hinge: {kind: revolute, parent: "
                  "world, child: arm, axis: z}\ndrives:\n  motor: {kind: joint, joint: hinge}\n");
    input->argv = {(*random)() % 2 == 0 ? "inertia" : "model",
                   (input->folder / "model.yaml").string()};
  }

  const Options& options_;
  std::string trouble_, archive_;
  std::vector<ArchiveEntry> packed_;  // what archive_ holds
  fs::path results_;
  std::vector<fs::path> studies_, papers_;
  std::vector<fs::path> models_, motions_, stiffness_, urdfs_, mjcfs_, sdfs_, tables_;
};

// Whether the program kept its promise; a reason if not.
std::string Broken(const WorkerEnd& end) {
  if (end.timed_out) return "hangs";
  if (end.signal != 0) return fmt::format("ended by signal {}", end.signal);
  if (end.exit_code < 0 || end.exit_code > 3) return fmt::format("exit code {}", end.exit_code);
  return "";
}

int Run(const Options& options) {
  constexpr size_t kBatch = 256;  // folders at a time
  // A program with sanitizers takes some twenty times as long, beside others still longer.
  constexpr double kTimeout_s = test::kSanitized ? 600.0 : 60.0;
  fs::remove_all(fs::path(options.out) / "work");
  const Maker maker(options);
  if (!maker.trouble().empty()) {
    fmt::print("{}\n", maker.trouble());
    return 3;
  }
  const auto start = std::chrono::steady_clock::now();
  std::map<int, size_t> codes;
  size_t broken = 0;
  double slowest_s = 0.0;
  for (size_t from = 0; from < options.count; from += kBatch) {
    std::vector<Input> inputs;
    std::vector<WorkerJob> jobs;
    for (size_t k = from; k < std::min(from + kBatch, options.count); ++k) {
      inputs.push_back(maker.Make(k));
      jobs.push_back({inputs.back().argv, inputs.back().folder / "log.txt"});
    }
    WorkerPool pool;
    pool.parallel = options.jobs;
    pool.timeout_s = kTimeout_s;
    pool.ended = [&](size_t job, const WorkerEnd& end) {
      ++codes[end.exit_code];
      slowest_s = std::max(slowest_s, end.cost.wall_s);
      const Input& input = inputs[job];
      const std::string why = Broken(end);
      if (!why.empty()) {
        ++broken;
        const fs::path kept = fs::path(options.out) / "found" /
                              fmt::format("{}_{}", options.seed, input.folder.filename().string());
        fs::create_directories(kept.parent_path());
        fs::remove_all(kept);
        fs::copy(input.folder, kept, fs::copy_options::recursive);
        fmt::print("{}: {}: {}\n", kept.string(), why, fmt::join(input.argv, " "));
      }
      fs::remove_all(input.folder);
    };
    (void)pool.Run(jobs);
  }
  fs::remove_all(fs::path(options.out) / "work");
  const std::chrono::duration<double> took = std::chrono::steady_clock::now() - start;
  fmt::print("{} inputs in {:.0f} s, slowest {:.1f} s; exit codes", options.count, took.count(),
             slowest_s);
  for (const auto& [code, count] : codes) fmt::print("  {}: {}", code, count);
  fmt::print("; {} broken\n", broken);
  return broken == 0 ? 0 : 1;
}

}  // namespace
}  // namespace mbv::fuzz

int main(int argc, char** argv) {
  mbv::fuzz::Options options;
  CLI::App app("Structurally changed inputs for the whole program");
  app.add_option("--program", options.program)->required();
  app.add_option("--source", options.source)->required();
  app.add_option("--out", options.out)->required();
  app.add_option("--count", options.count);
  app.add_option("--seed", options.seed);
  app.add_option("--jobs", options.jobs)->check(CLI::Range(1, 1024));
  CLI11_PARSE(app, argc, argv);
  return mbv::fuzz::Run(options);
}
