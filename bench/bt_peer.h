#pragma once

#include <benchmark/benchmark.h>

#include <string>

/// The same measurements with an installed BehaviorTree.CPP 4 (bt_bench.cmake looks for one).
namespace sentree::peer {

/// One iteration is one tick of that tree: `tickExactlyOnce`, or `tickOnce`.
void tick(benchmark::State& bench, const std::string& xml, bool exactly_once);
/// One iteration is one `createTreeFromText`.
void load(benchmark::State& bench, const std::string& xml);

/// Runs all benchmarks and prints how much faster ours are: the least times of the run, peer / ours.
int main(int argc, char** argv);

}  // namespace sentree::peer
