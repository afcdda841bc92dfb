// Asks a running service where a scan was taken. Needs libcurl:
//   g++ -std=c++17 -O2 examples/call.cpp -lcurl -o call && ./call http://127.0.0.1:8000
// A key, where the service wants one, in LINEFIX_KEY. The request is written by hand; for the answer take the JSON
// library that the project has already, here the three values that a robot cannot do without are picked out.
#include <array>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include <curl/curl.h>

using Segment = std::array<double, 4>;  // x1, y1, x2, y2, metres; free space on the left

struct Pose {
  double x, y, theta;  // of the scan frame in the map frame; metres, radians
};

// The numbers with all the digits that a double has.
std::string to_json(const std::vector<Segment>& segments) {
  std::string text = "[";
  char row[128];
  for (const Segment& s : segments) {
    std::snprintf(row, sizeof row, "%s[%.17g,%.17g,%.17g,%.17g]", text.size() > 1 ? "," : "", s[0], s[1], s[2], s[3]);
    text += row;
  }
  return text + "]";
}

std::size_t append(char* data, std::size_t size, std::size_t count, void* into) {
  static_cast<std::string*>(into)->append(data, size * count);
  return size * count;
}

// Posts JSON; throws what the service says where it refuses (application/problem+json).
std::string post(const std::string& url, const std::string& body) {
  std::unique_ptr<CURL, decltype(&curl_easy_cleanup)> curl(curl_easy_init(), curl_easy_cleanup);
  curl_slist* headers = curl_slist_append(nullptr, "Content-Type: application/json");
  if (const char* key = std::getenv("LINEFIX_KEY"))
    headers = curl_slist_append(headers, (std::string("Authorization: Bearer ") + key).c_str());
  std::string answer;
  curl_easy_setopt(curl.get(), CURLOPT_URL, url.c_str());
  curl_easy_setopt(curl.get(), CURLOPT_HTTPHEADER, headers);
  curl_easy_setopt(curl.get(), CURLOPT_POSTFIELDS, body.c_str());
  curl_easy_setopt(curl.get(), CURLOPT_POSTFIELDSIZE, static_cast<long>(body.size()));
  curl_easy_setopt(curl.get(), CURLOPT_TIMEOUT_MS, 5000L);
  curl_easy_setopt(curl.get(), CURLOPT_WRITEFUNCTION, append);
  curl_easy_setopt(curl.get(), CURLOPT_WRITEDATA, &answer);
  const CURLcode code = curl_easy_perform(curl.get());
  long status = 0;
  curl_easy_getinfo(curl.get(), CURLINFO_RESPONSE_CODE, &status);
  curl_slist_free_all(headers);
  if (code != CURLE_OK) throw std::runtime_error(curl_easy_strerror(code));
  if (status != 200) throw std::runtime_error(std::to_string(status) + ": " + answer);
  return answer;
}

// The text behind the first `"name":`. Good for the first fields of this answer, which come before any list.
std::string field(const std::string& json, const std::string& name) {
  const auto at = json.find("\"" + name + "\":");
  if (at == std::string::npos) throw std::runtime_error("the answer has no " + name);
  return json.substr(at + name.size() + 3);
}

// The pose, where a robot may act on it.
std::optional<Pose> usable_pose(const std::string& answer) {
  if (field(answer, "usable").rfind("true", 0) != 0) return std::nullopt;
  const std::string pose = field(answer, "pose");
  return Pose{std::strtod(field(pose, "x").c_str(), nullptr), std::strtod(field(pose, "y").c_str(), nullptr),
              std::strtod(field(pose, "theta").c_str(), nullptr)};
}

int main(int argc, char** argv) try {
  const std::string url = argc > 1 ? argv[1] : "http://127.0.0.1:8000";
  // An L-shaped room, and its walls as seen from (1, 1) by a robot that looks along the map's y axis.
  const std::vector<Segment> walls = {{0, 0, 6, 0}, {6, 0, 6, 2}, {6, 2, 4, 2}, {4, 2, 4, 5}, {4, 5, 0, 5}, {0, 5, 0, 0}};
  std::vector<Segment> seen;
  for (const auto& [x1, y1, x2, y2] : walls) seen.push_back({y1 - 1, 1 - x1, y2 - 1, 1 - x2});

  const std::string answer = post(url + "/v1/associate", "{\"map\":{\"segments\":" + to_json(walls) +
                                                             "},\"scan\":{\"segments\":" + to_json(seen) +
                                                             ",\"sigma\":0.02},\"options\":{\"deadline_ms\":1000}}");
  const std::string status = field(answer, "status");
  std::printf("status %s\n", status.substr(1, status.find('"', 1) - 1).c_str());
  if (const auto pose = usable_pose(answer)) {
    std::printf("x %.3f m, y %.3f m, theta %.4f rad\n", pose->x, pose->y, pose->theta);
    return 0;
  }
  std::printf("no pose to act on\n");
  return 1;
} catch (const std::exception& error) {
  std::fprintf(stderr, "%s\n", error.what());
  return 2;
}
