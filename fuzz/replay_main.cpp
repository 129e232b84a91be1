// Runs a fuzz target where there is no libFuzzer: each file of the corpus, then seeded mutations of them. The same seed
// tries the same inputs. The input that ends the program is left in crash-<target>.
//
//   x_fuzz [--runs N] [--seed S] [--dictionary FILE] [FILE or FOLDER]…

#include <algorithm>
#include <charconv>
#include <csignal>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <string_view>
#include <vector>

#include "sentree/base/rng.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);

namespace {

constexpr std::size_t kInputBytesMax = 64 * 1024;
constexpr int kMutationsMax = 8;

std::string current_input;  // for the signal handler
std::string crash_file;

void save_input(int signal) {
  // The process is lost; what matters is that its last input is not.
  if (std::FILE* file = std::fopen(crash_file.c_str(), "wb")) {
    std::fwrite(current_input.data(), 1, current_input.size(), file);
    std::fclose(file);
  }
  std::signal(signal, SIG_DFL);
  std::raise(signal);
}

void run(std::string input) {
  current_input = std::move(input);
  LLVMFuzzerTestOneInput(reinterpret_cast<const std::uint8_t*>(current_input.data()), current_input.size());
}

std::string read(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  std::string bytes(std::istreambuf_iterator<char>(file), {});
  bytes.resize(std::min(bytes.size(), kInputBytesMax));
  return bytes;
}

// The quoted tokens of libFuzzer's dictionary format, one a line; \" \\ and \xNN inside.
std::vector<std::string> read_dictionary(const std::filesystem::path& path) {
  std::vector<std::string> tokens;
  std::ifstream file(path);
  for (std::string line; std::getline(file, line);) {
    const std::size_t open = line.find('"');
    const std::size_t close = line.rfind('"');
    if (line.empty() || line[0] == '#' || open == close) continue;
    std::string token;
    for (std::size_t i = open + 1; i < close; ++i) {
      if (line[i] != '\\' || i + 1 >= close) {
        token += line[i];
      } else if (line[i + 1] == 'x' && i + 3 < close) {
        unsigned value = 0;
        std::from_chars(line.data() + i + 2, line.data() + i + 4, value, 16);
        token += static_cast<char>(value);
        i += 3;
      } else {
        token += line[++i];
      }
    }
    tokens.push_back(std::move(token));
  }
  return tokens;
}

class Mutator {
 public:
  Mutator(std::uint64_t seed, const std::vector<std::string>& corpus, const std::vector<std::string>& tokens)
      : rng_(seed), corpus_(corpus), tokens_(tokens) {}

  std::string next() {
    std::string input = pick(corpus_);
    for (std::uint64_t n = 1 + rng_.below(kMutationsMax); n > 0; --n) mutate(input);
    input.resize(std::min(input.size(), kInputBytesMax));
    return input;
  }

 private:
  std::string pick(const std::vector<std::string>& from) {
    return from.empty() ? std::string() : from[rng_.below(from.size())];
  }
  std::size_t place(const std::string& input) { return rng_.below(input.size() + 1); }

  std::string piece(const std::string& of) {
    const std::size_t start = place(of);
    return of.substr(start, rng_.below(64));
  }

  void mutate(std::string& input) {
    switch (rng_.below(7)) {
      case 0:
        if (!input.empty()) input[rng_.below(input.size())] ^= static_cast<char>(1U << rng_.below(8));
        break;
      case 1: input.insert(place(input), 1, static_cast<char>(rng_.below(256))); break;
      case 2: input.erase(place(input), rng_.below(16)); break;
      case 3: input.insert(place(input), piece(input)); break;
      case 4: input.insert(place(input), pick(tokens_)); break;
      case 5: input.insert(place(input), piece(pick(corpus_))); break;
      case 6: input.resize(place(input)); break;
    }
  }

  sentree::Rng rng_;
  const std::vector<std::string>& corpus_;
  const std::vector<std::string>& tokens_;
};

}  // namespace

int main(int argc, char** argv) {
  std::uint64_t runs = 1000;
  std::uint64_t seed = 1;
  std::vector<std::filesystem::path> files;
  std::vector<std::string> tokens;
  for (int i = 1; i < argc; ++i) {
    const std::string_view argument = argv[i];
    if (argument == "--runs" && i + 1 < argc) {
      runs = std::strtoull(argv[++i], nullptr, 10);
    } else if (argument == "--seed" && i + 1 < argc) {
      seed = std::strtoull(argv[++i], nullptr, 10);
    } else if (argument == "--dictionary" && i + 1 < argc) {
      tokens = read_dictionary(argv[++i]);
    } else if (std::filesystem::is_directory(argument)) {
      for (const auto& entry : std::filesystem::directory_iterator(argument)) files.push_back(entry.path());
    } else if (std::filesystem::is_regular_file(argument)) {
      files.emplace_back(argument);
    }
  }
  std::sort(files.begin(), files.end());
  crash_file = "crash-" + std::filesystem::path(argv[0]).filename().string();
  for (const int signal : {SIGABRT, SIGSEGV, SIGFPE, SIGBUS, SIGILL}) std::signal(signal, save_input);

  std::printf("%zu files, %llu mutations, seed %llu\n", files.size(), static_cast<unsigned long long>(runs),
              static_cast<unsigned long long>(seed));
  std::fflush(stdout);
  std::vector<std::string> corpus;
  for (const auto& file : files) {
    corpus.push_back(read(file));
    run(corpus.back());
  }
  Mutator mutator(seed, corpus, tokens);
  for (std::uint64_t i = 0; i < runs; ++i) run(mutator.next());
  return 0;
}
