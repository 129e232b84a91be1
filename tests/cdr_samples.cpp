// usage: cdr_samples SEED COUNT: random types of ROS with a random value each, as JSON lines: the definition with those
// that it uses, the value, and the octets that the codec makes of it. Octets that it does not read back are left out,
// and the exit code is 1.

#include <cstdlib>
#include <iostream>

#include "sentree/idl/conform.h"
#include "sentree/ros/detail/cdr.h"
#include "sentree/ros/detail/test_chance.h"

int main(int argc, char** argv) {
  using namespace sentree;
  if (argc != 3) return 2;
  const std::uint64_t first = std::strtoull(argv[1], nullptr, 10);
  const std::uint64_t count = std::strtoull(argv[2], nullptr, 10);
  int code = 0;
  for (std::uint64_t seed = first; seed < first + count; ++seed) {
    ros::Chance chance(seed);
    const std::string definition = chance.message();
    const idl::Struct& type = ros::fields_of(ros::loaded_schema(definition));
    const auto codec = ros::Codec::make(type);
    const Value value = chance.value(type);
    std::vector<std::uint8_t> octets;
    ros::begin_message(octets);
    if (!codec || !codec->write(octets, value) || codec->read(octets, ros::kEncapsulation) != value) {
      std::cerr << "seed " << seed << ": " << definition;
      code = 1;
      continue;
    }
    std::string whole = definition;
    for (const auto& [file, text] : ros::messages()) {
      const std::string name = file.substr(0, file.find('/')) + file.substr(file.rfind('/'));
      whole += std::string(80, '=') + "\nMSG: " + name.substr(0, name.size() - 4) + "\n" + text;
    }
    std::string hex;
    for (const std::uint8_t octet : octets) {
      constexpr const char* kDigits = "0123456789abcdef";
      hex += {kDigits[octet >> 4U], kDigits[octet & 15U]};
    }
    std::cout << to_json(Map{{"seed", static_cast<std::int64_t>(seed)},
                             {"definition", whole},
                             {"value", idl::for_script(value)},
                             {"octets", hex}})
              << "\n";
  }
  return code;
}
