#include "sentree/studio/difference.h"

#include <fmt/format.h>

#include "sentree/project/project.h"
#include "sentree/project/skill_models.h"
#include "sentree/studio/detail/nothing.h"
#include "sentree/studio/detail/sides.h"

namespace sentree::studio {

namespace fs = std::filesystem;

namespace {

bool holds_files(const fs::path& path) {
  std::error_code error;
  return fs::is_directory(path, error) || path.extension() == ".mcap";
}

// What the project's own nodes are, so that they are drawn as such.
std::vector<bt::NodeModel> models_of(const fs::path& folder) {
  std::error_code error;
  if (!fs::is_regular_file(folder / "sentree.yaml", error)) return {};
  const auto project = project::load_project(folder);
  if (!project.value) return {};
  auto models = project::skill_models(*project.value);
  return models.value ? std::move(*models.value) : std::vector<bt::NodeModel>();
}

}  // namespace

struct DifferencePage::Impl {
  Impl(Sides compared, const fs::path& before, const fs::path& after)
      : sides(std::move(compared)), kinds(models_of(after)), before_name(before.string()), after_name(after.string()) {}

  [[nodiscard]] Result<Value> carry_out(const std::string& op, const Value& request) const {
    if (op == "compare_files")
      return Value(Map{{"before", before_name}, {"after", after_name}, {"files", changed_files(sides)}});
    if (op == "compare") {
      const Value* file = request.find("file");
      return comparison_of(sides, file != nullptr ? std::string(file->text()) : std::string(), kinds);
    }
    return fail("studio.request", fmt::format("\"{}\" is not known here: this page only compares", op));
  }

  const Sides sides;
  const design::Kinds kinds;
  const std::string before_name;
  const std::string after_name;
  const Nothing nothing;
  std::unique_ptr<Server> server;
};

DifferencePage::DifferencePage(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
DifferencePage::~DifferencePage() { impl_->server.reset(); }
const Server& DifferencePage::server() const { return *impl_->server; }

Result<std::unique_ptr<DifferencePage>> DifferencePage::start(const fs::path& before, const fs::path& after,
                                                              ServerOptions options) {
  auto was = texts_at(before);
  if (!was) return tl::unexpected(was.error());
  auto is = texts_at(after);
  if (!is) return tl::unexpected(is.error());
  Sides sides{std::move(*was), std::move(*is)};
  if (!holds_files(before) && !holds_files(after)) {
    // Two files are one another's counterparts, whatever they are called.
    if (sides.before.size() == 1 && sides.after.size() == 1)
      sides.before = {{sides.after.begin()->first, sides.before.begin()->second}};
  } else if (holds_files(before) != holds_files(after)) {
    return fail("diff.unlike", "a folder can only be compared with a folder, or with a recording's project");
  } else if (const bool was_run = before.extension() == ".mcap"; was_run != (after.extension() == ".mcap")) {
    keep_what_was_read(was_run ? sides.before : sides.after, was_run ? sides.after : sides.before);
  }
  auto impl = std::make_unique<Impl>(std::move(sides), before, after);
  options.compare = true;
  options.live = false;
  auto server =
      Server::start(impl->nothing.subject, impl->nothing.history,
                    {.update = {},
                     .facts = [] { return RunFacts{.state = "ended"}; },
                     .steer = [raw = impl.get()](const std::string& op,
                                                 const Value& request) { return raw->carry_out(op, request); }},
                    std::move(options));
  if (!server) return tl::unexpected(server.error());
  impl->server = std::move(*server);
  return std::unique_ptr<DifferencePage>(new DifferencePage(std::move(impl)));
}

}  // namespace sentree::studio
