// Feeds files, and beginnings of them, to one fuzz target: keeps the targets building and their
// promises tested where libFuzzer does not run. replay FILE_OR_FOLDER…
#include <cstddef>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>

extern "C" int LLVMFuzzerTestOneInput(const unsigned char* data, std::size_t size);

namespace {

constexpr std::size_t kBeginnings = 3;

int Replay(const std::filesystem::path& file) {
  std::ifstream stream(file, std::ios::binary);
  const std::string text((std::istreambuf_iterator<char>(stream)), {});
  for (std::size_t k = 1; k <= kBeginnings; ++k) {
    // A copy of the exact length: reading past its end is seen by the address sanitizer.
    const std::string part = text.substr(0, text.size() * k / kBeginnings);
    (void)LLVMFuzzerTestOneInput(reinterpret_cast<const unsigned char*>(part.data()), part.size());
  }
  return 1;
}

}  // namespace

int main(int argc, char** argv) {
  int files = 0;
  for (int i = 1; i < argc; ++i) {
    const std::filesystem::path path = argv[i];
    if (!std::filesystem::is_directory(path)) {
      files += Replay(path);
      continue;
    }
    for (const auto& entry : std::filesystem::recursive_directory_iterator(path)) {
      if (entry.is_regular_file()) files += Replay(entry.path());
    }
  }
  std::printf("%d files\n", files);
  return files > 0 ? 0 : 1;
}
