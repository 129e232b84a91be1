#pragma once

#include <functional>
#include <string>

/// The charts of scxml_bench in Qt SCXML: registers qt/NAME for each, with the same documents.
void register_qt_benchmarks(const std::function<std::string(const std::string& name)>& source_of);
