#include <cstdio>

#include "sentree/base/value.h"

int main() {
  const sentree::Value value = sentree::Map{{"status", "SUCCESS"}};
  std::puts(std::string(value.find("status")->text()).c_str());
}
