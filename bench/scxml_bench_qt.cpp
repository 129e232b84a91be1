#include "scxml_bench_qt.h"

#include <benchmark/benchmark.h>

#include <QBuffer>
#include <QCoreApplication>
#include <QLoggingCategory>
#include <QScxmlStateMachine>
#include <memory>

namespace {

std::unique_ptr<QScxmlStateMachine> machine_of(const std::string& source) {
  QByteArray bytes = QByteArray::fromStdString(source);
  QBuffer buffer(&bytes);
  buffer.open(QIODevice::ReadOnly);
  return std::unique_ptr<QScxmlStateMachine>(QScxmlStateMachine::fromData(&buffer));
}

// One event up to the stable configuration, as in our own benchmarks.
void run_events(benchmark::State& state, const std::string& source) {
  const auto machine = machine_of(source);
  machine->start();
  QCoreApplication::processEvents();
  const QVariant data(QVariantMap{{"level", 50}});
  for (auto _ : state) {
    machine->submitEvent(QStringLiteral("e"), data);
    QCoreApplication::processEvents();
  }
  if (!machine->isRunning()) state.SkipWithError("the machine ended");
}

// Up to a started machine: Qt does part of the work then.
void run_load(benchmark::State& state, const std::string& source) {
  for (auto _ : state) {
    const auto machine = machine_of(source);
    machine->start();
    QCoreApplication::processEvents();
  }
}

}  // namespace

void register_qt_benchmarks(const std::function<std::string(const std::string& name)>& source_of) {
  static int argc = 1;
  static char name[] = "scxml_bench";
  static char* argv[] = {name, nullptr};
  static QCoreApplication application(argc, argv);
  QLoggingCategory::setFilterRules("*.debug=false");
  for (const char* chart : {"flipflop_null", "flipflop_ecmascript", "guardassign", "level_monitor", "par10_null"}) {
    benchmark::RegisterBenchmark((std::string("qt/") + chart).c_str(),
                                 [source = source_of(chart)](benchmark::State& s) { run_events(s, source); });
  }
  benchmark::RegisterBenchmark("qt/load1000", [source = source_of("load1000")](benchmark::State& s) {
    run_load(s, source);
  })->Unit(benchmark::kMillisecond);
}
