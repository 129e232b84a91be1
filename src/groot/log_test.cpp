#include "sentree/groot/log.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstring>

#include "sentree/bt/load.h"
#include "sentree/groot/image.h"
#include "sentree/text/xml.h"

namespace sentree::groot {
namespace {

using bt::NodeId;
using bt::Status;
using bt::Tree;

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::UnorderedElementsAre;

constexpr std::string_view kFile = R"(<root BTCPP_format="4" main_tree_to_execute="Main">
  <BehaviorTree ID="Main">
    <Fallback name="Root">
      <SubTree ID="Fetch" name="first" place="kitchen"/>
      <Inverter><SubTree ID="Fetch" place="hall"/></Inverter>
      <AlwaysSuccess _skipIf="1 &gt; 2"/>
    </Fallback>
  </BehaviorTree>
  <BehaviorTree ID="Fetch">
    <Sequence><Check/><GoTo name="Go &quot;there&quot;" destination="{place}"/></Sequence>
  </BehaviorTree>
  <TreeNodesModel>
    <Condition ID="Check"/>
    <Action ID="GoTo"><input_port name="destination" type="std::string">where to</input_port>
      <output_port name="took"/></Action>
  </TreeNodesModel>
</root>)";

Tree logged_tree(std::string_view xml = kFile) {
  auto loaded = bt::load(std::string(xml));
  EXPECT_TRUE(loaded.ok()) << (loaded.diagnostics.empty() ? "" : to_string(loaded.diagnostics[0]));
  return std::move(*loaded.value);
}

std::vector<Transition> transitions(const Tree& tree) {
  const auto at = [](std::int64_t ms) { return TimePoint(std::chrono::milliseconds(ms)); };
  const NodeId last = static_cast<NodeId>(tree.size() - 1);
  return {{at(0), 0, Status::kIdle, Status::kRunning},
          {at(1500), last, Status::kIdle, Status::kSkipped},
          {at(4'000'000), 2, Status::kRunning, Status::kFailure},
          {at(4'000'001), 0, Status::kRunning, Status::kSuccess}};
}

// What the formats' descriptions say, read on its own.
std::uint64_t number(std::string_view bytes, std::size_t at, std::size_t size) {
  std::uint64_t value = 0;
  EXPECT_LE(at + size, bytes.size());
  for (std::size_t i = 0; i < size && at + i < bytes.size(); ++i)
    value |= std::uint64_t{static_cast<unsigned char>(bytes[at + i])} << (8 * i);
  return value;
}

// A table of a FlatBuffer, by the slots of its vtable.
class Table {
 public:
  Table(std::string_view bytes, std::size_t at) : bytes_(bytes), at_(at) {
    EXPECT_EQ(at % 4, 0u);
    vtable_ = at - static_cast<std::size_t>(static_cast<std::int32_t>(number(bytes, at, 4)));
    EXPECT_EQ(vtable_ % 2, 0u);
  }
  static Table root(std::string_view bytes) { return {bytes, number(bytes, 0, 4)}; }

  std::uint64_t scalar(std::size_t slot, std::size_t size) const { return number(bytes_, field(slot), size); }
  std::string text(std::size_t slot) const {
    const std::size_t at = reference(field(slot));
    const std::size_t length = number(bytes_, at, 4);
    EXPECT_EQ(bytes_[at + 4 + length], '\0');
    return std::string(bytes_.substr(at + 4, length));
  }
  std::vector<Table> tables(std::size_t slot) const {
    const std::size_t at = reference(field(slot));
    std::vector<Table> all;
    for (std::size_t i = 0; i < number(bytes_, at, 4); ++i) all.push_back({bytes_, reference(at + 4 + 4 * i)});
    return all;
  }
  std::vector<std::uint64_t> numbers16(std::size_t slot) const {
    const std::size_t at = reference(field(slot));
    std::vector<std::uint64_t> all;
    for (std::size_t i = 0; i < number(bytes_, at, 4); ++i) all.push_back(number(bytes_, at + 4 + 2 * i, 2));
    return all;
  }

 private:
  std::size_t field(std::size_t slot) const {
    EXPECT_LT(slot, number(bytes_, vtable_, 2));
    const std::size_t offset = number(bytes_, vtable_ + slot, 2);
    EXPECT_NE(offset, 0u);
    EXPECT_LT(offset, number(bytes_, vtable_ + 2, 2));
    return at_ + offset;
  }
  std::size_t reference(std::size_t at) const {
    EXPECT_EQ(at % 4, 0u);
    return at + number(bytes_, at, 4);
  }
  std::string_view bytes_;
  std::size_t at_;
  std::size_t vtable_;
};

struct Decoded {
  std::uint64_t seconds, micros, uid, from, to;
  friend bool operator==(const Decoded&, const Decoded&) = default;
};

TEST(Groot1Log, HoldsTheTreeAndItsTransitions) {
  const Tree tree = logged_tree();
  const auto file = write_fbl(tree, transitions(tree), 1'700'000'000'000'000);
  ASSERT_TRUE(file.has_value());
  const std::size_t size = number(*file, 0, 4);
  const std::string_view bytes = std::string_view(*file).substr(4, size);
  const Table root = Table::root(bytes);
  EXPECT_EQ(root.scalar(4, 2), 1u);
  const auto nodes = root.tables(6);
  ASSERT_EQ(nodes.size(), tree.size());
  for (NodeId node = 0; node < tree.size(); ++node) {
    SCOPED_TRACE(tree.path(node));
    const Table& table = nodes[node];
    EXPECT_EQ(table.scalar(4, 2), node + 1u);
    std::vector<std::uint64_t> children;
    for (const NodeId child : tree.children(node)) children.push_back(child + 1u);
    EXPECT_EQ(table.numbers16(6), children);
    EXPECT_EQ(table.scalar(8, 1), 0u);
    EXPECT_EQ(table.text(10), tree.name(node));
    EXPECT_EQ(table.text(12), node == 1 || node == 6 ? "Fetch" : tree.registration(node));
    const auto remaps = table.tables(14);
    ASSERT_EQ(remaps.size(), tree.ports(node).size());
    for (std::size_t i = 0; i < remaps.size(); ++i) {
      EXPECT_EQ(remaps[i].text(4), tree.ports(node)[i].name);
      EXPECT_EQ(remaps[i].text(6), tree.ports(node)[i].text);
    }
  }
  std::vector<std::pair<std::string, std::uint64_t>> models;
  for (const Table& model : root.tables(8)) {
    models.emplace_back(model.text(4), model.scalar(6, 1));
    if (model.text(4) != "GoTo") continue;
    const auto ports = model.tables(8);
    ASSERT_FALSE(ports.empty());
    EXPECT_EQ(ports[0].text(4), "destination");
    EXPECT_EQ(ports[0].scalar(6, 1), 0u);
    EXPECT_EQ(ports[0].text(8), "std::string");
    EXPECT_EQ(ports[0].text(10), "");
  }
  EXPECT_THAT(models, UnorderedElementsAre(std::pair("Fallback", 3u), std::pair("Sequence", 3u),
                                           std::pair("Inverter", 4u), std::pair("AlwaysSuccess", 1u),
                                           std::pair("GoTo", 1u), std::pair("Check", 2u), std::pair("Fetch", 5u)));
  std::vector<Decoded> log;
  ASSERT_EQ((file->size() - 4 - size) % 12, 0u);
  for (std::size_t at = 4 + size; at < file->size(); at += 12)
    log.push_back({number(*file, at, 4), number(*file, at + 4, 4), number(*file, at + 8, 2), number(*file, at + 10, 1),
                   number(*file, at + 11, 1)});
  EXPECT_THAT(log, ElementsAre(Decoded{1'700'000'000, 0, 1, 0, 1}, Decoded{1'700'000'001, 500'000, tree.size(), 0, 0},
                               Decoded{1'700'004'000, 0, 3, 1, 3}, Decoded{1'700'004'000, 1'000, 1, 1, 2}));
}

void collect(const text::XmlElement& element, std::vector<std::pair<std::string, std::string>>& nodes) {
  if (const auto uid = element.attribute("_uid")) {
    std::string text(element.name());
    for (const char* name : {"ID", "name", "_fullpath", "destination", "place", "_skipIf"}) {
      if (const auto value = element.attribute(name)) text += " " + std::string(name) + "=" + std::string(*value);
    }
    nodes.emplace_back(*uid, text);
  }
  for (auto child = element.first_child(); child; child = child.next_sibling()) collect(child, nodes);
}

TEST(Groot2Log, HoldsTheTreeWithNumbersAndItsTransitions) {
  const Tree tree = logged_tree();
  const auto file = write_btlog(tree, transitions(tree), 1'700'000'000'000'000);
  ASSERT_TRUE(file.has_value());
  EXPECT_EQ(file->substr(0, 19), std::string("BTCPP4-FileLogger2\x01"));
  const std::size_t size = number(*file, 19, 4);
  const auto xml = text::XmlDocument::parse(file->substr(23, size), "log");
  ASSERT_TRUE(xml.has_value()) << to_string(xml.error());
  EXPECT_EQ(xml->root().attribute("BTCPP_format"), "4");
  std::vector<std::string> trees;
  std::vector<std::pair<std::string, std::string>> nodes;
  for (auto child = xml->root().first_child(); child; child = child.next_sibling()) {
    if (child.name() != "BehaviorTree") continue;
    trees.push_back(std::string(*child.attribute("ID")) + ":" + std::string(*child.attribute("_fullpath")));
    collect(child, nodes);
  }
  EXPECT_THAT(trees, ElementsAre("Main:", "Fetch:first", "Fetch:Fetch::7"));
  EXPECT_THAT(nodes, UnorderedElementsAre(std::pair("1", "Fallback name=Root"),
                                          std::pair("2", "SubTree ID=Fetch _fullpath=first place=kitchen"),
                                          std::pair("3", "Sequence name=Sequence"), std::pair("4", "Check name=Check"),
                                          std::pair("5", "GoTo name=Go \"there\" destination={place}"),
                                          std::pair("6", "Inverter name=Inverter"),
                                          std::pair("7", "SubTree ID=Fetch _fullpath=Fetch::7 place=hall"),
                                          std::pair("8", "Sequence name=Sequence"), std::pair("9", "Check name=Check"),
                                          std::pair("10", "GoTo name=Go \"there\" destination={place}"),
                                          std::pair("11", "AlwaysSuccess name=AlwaysSuccess _skipIf=1 > 2")));
  std::vector<std::string> described;
  const auto models = xml->root().child("TreeNodesModel");
  ASSERT_TRUE(models);
  for (auto model = models.first_child(); model; model = model.next_sibling())
    described.emplace_back(*model.attribute("ID"));
  EXPECT_THAT(described, ::testing::IsSupersetOf({"GoTo", "Check", "Sequence", "Inverter"}));

  EXPECT_EQ(number(*file, 23 + size, 8), 1'700'000'000'000'000u);
  std::vector<Decoded> log;
  ASSERT_EQ((file->size() - 31 - size) % 9, 0u);
  for (std::size_t at = 31 + size; at < file->size(); at += 9)
    log.push_back({0, number(*file, at, 6), number(*file, at + 6, 2), 0, number(*file, at + 8, 1)});
  EXPECT_THAT(log, ElementsAre(Decoded{0, 0, 1, 0, 1}, Decoded{0, 1'500'000, tree.size(), 0, 4},
                               Decoded{0, 4'000'000'000, 3, 0, 3}, Decoded{0, 4'000'001'000, 1, 0, 2}));
}

TEST(Groot1Log, GivesARegistrationThePortsOfAllItsNodes) {
  const Tree tree = logged_tree(R"(<root BTCPP_format="4"><BehaviorTree ID="Main"><Sequence>
      <Action ID="GoTo" to="a"/><Action ID="GoTo" to="b" why="{why}"/></Sequence></BehaviorTree>
    <TreeNodesModel><Action ID="GoTo"/></TreeNodesModel></root>)");
  const auto file = write_fbl(tree, {});
  ASSERT_TRUE(file.has_value());
  const std::string_view bytes = std::string_view(*file).substr(4, number(*file, 0, 4));
  std::vector<std::string> ports;
  for (const Table& model : Table::root(bytes).tables(8)) {
    if (model.text(4) != "GoTo") continue;
    for (const Table& port : model.tables(8)) ports.push_back(port.text(4));
  }
  EXPECT_THAT(ports, ElementsAre("to", "why"));
}

TEST(Groot1Log, HasAStopForTheFirstTickOfARunThatBeginsAtZero) {
  const Tree tree = logged_tree();
  const auto file = write_fbl(tree, transitions(tree));
  ASSERT_TRUE(file.has_value());
  const std::size_t first = 4 + number(*file, 0, 4);
  EXPECT_EQ(number(*file, first, 4), 0u);
  EXPECT_EQ(number(*file, first + 4, 4), 1'000u);
}

TEST(InstancePaths, AreDistinctAlsoWhereNamesAreNot) {
  const Tree tree = logged_tree(R"(<root BTCPP_format="4" main_tree_to_execute="Main"><BehaviorTree ID="Main"><Sequence>
      <SubTree ID="A" name="twice"/><SubTree ID="A" name="twice"/><SubTree ID="A"/><SubTree ID="A"/>
    </Sequence></BehaviorTree>
    <BehaviorTree ID="A"><SubTree ID="B"/></BehaviorTree>
    <BehaviorTree ID="B"><AlwaysSuccess/></BehaviorTree></root>)");
  std::vector<std::string> paths = instance_paths(tree);
  std::erase(paths, "");
  EXPECT_THAT(paths,
              ElementsAre("twice", "twice/B::3", "A::5", "A::5/B::6", "A::8", "A::8/B::9", "A::11", "A::11/B::12"));
}

TEST(GrootLogs, RefuseTreesThatTheyCannotNumber) {
  std::string xml = "<root BTCPP_format=\"4\"><BehaviorTree ID=\"Main\"><Sequence>";
  for (std::size_t i = 1; i < kNodesMax; ++i) xml += "<AlwaysSuccess/>";
  const std::string end = "</Sequence></BehaviorTree></root>";
  const Tree largest = logged_tree(xml + end);
  ASSERT_EQ(largest.size(), kNodesMax);
  EXPECT_TRUE(write_fbl(largest, {}).has_value());
  EXPECT_TRUE(write_btlog(largest, {}).has_value());
  const Tree too_large = logged_tree(xml + "<AlwaysSuccess/>" + end);
  EXPECT_EQ(write_fbl(too_large, {}).error().code, "groot.too-many-nodes");
  EXPECT_EQ(write_btlog(too_large, {}).error().code, "groot.too-many-nodes");
}

}  // namespace
}  // namespace sentree::groot
