// The README's request and its answer in C++17, with types that quicktype makes of the OpenAPI document: `make clients`.
// `call request` writes the request, `call answer` reads what the service says to it; how it gets there is not its matter.
#include <cstdio>
#include <iostream>
#include <string>

#include "linefix.hpp"

int main(int, char** arguments) {
  if (std::string(arguments[1]) == "request") {
    linefix::AssociateRequest request;
    request.map.segments = {{0, 0, 6, 0}, {6, 0, 6, 2}, {6, 2, 4, 2}, {4, 2, 4, 5}, {4, 5, 0, 5}, {0, 5, 0, 0}};
    request.scan.segments = {{-1.01, 0.99, -0.99, -4.98}, {-1, -4.99, 0.98, -5.01}, {1.01, -2.99, 3.98, -3.01},
                             {4.01, -2.98, 3.99, 0.98}, {1.6, -0.8, 1.2, -0.4}};
    request.scan.sigma = 0.02;
    std::cout << nlohmann::json(request);
    return 0;
  }
  const auto answer = nlohmann::json::parse(std::cin).get<linefix::AssociateAnswer>();
  const auto status = nlohmann::json(answer.status).get<std::string>();
  std::printf("%s %s %.3f\n", status.c_str(), answer.usable ? "true" : "false", answer.pose->x);
}
