// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/io/transform_stream.h"

#include <gtest/gtest.h>

#include <chrono>
#include <functional>
#include <memory>
#include <thread>
#include <vector>

#include "dyop/core/error.h"
#include "dyop/io/file_error.h"

namespace dyop {
namespace {

TransformMessage at(Scalar x) {
  return {"Device", RigidPose(Vector3(x, 0, 0))};
}

// Calls until it is true; the network within one machine takes well below this.
bool comes_true(const std::function<bool()>& is_true) {
  for (int k = 0; k < 5000; ++k) {
    if (is_true()) return true;
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  return false;
}

Scalar newest_of(TransformStream& stream) {
  std::optional<TransformMessage> message;
  EXPECT_TRUE(comes_true([&] { return (message = stream.receive()).has_value(); }));
  return message ? message->pose.translation().x() : -1;
}

TEST(TransformStream, CarriesMessagesBothWays) {
  TransformStream server(0);
  TransformStream client("127.0.0.1", server.port());
  EXPECT_EQ(client.send(at(3)), 1);
  EXPECT_EQ(newest_of(server), 3);
  EXPECT_EQ(server.send(at(4)), 1);
  EXPECT_EQ(newest_of(client), 4);
  EXPECT_FALSE(server.receive());
}

TEST(TransformStream, SendsToAllPeersAndHearsTheFirstThatSpeaks) {
  TransformStream server(0);
  TransformStream first("127.0.0.1", server.port());
  TransformStream second("127.0.0.1", server.port());
  EXPECT_EQ(server.send(at(1)), 2);
  EXPECT_EQ(newest_of(first), 1);
  EXPECT_EQ(newest_of(second), 1);
  second.send(at(9));
  EXPECT_EQ(newest_of(server), 9);
  for (int k = 0; k < 50; ++k) {
    first.send(at(1));
    second.send(at(10));
    EXPECT_EQ(newest_of(server), 10);
  }
}

TEST(TransformStream, APeerMayLeaveAndComeBack) {
  TransformStream server(0);
  {
    TransformStream client("127.0.0.1", server.port());
    client.send(at(1));
    EXPECT_EQ(newest_of(server), 1);
    EXPECT_EQ(server.peers(), 1);
  }
  EXPECT_TRUE(comes_true([&] {
    server.receive();
    return server.peers() == 0;
  }));
  EXPECT_EQ(server.send(at(2)), 0);
  TransformStream client("127.0.0.1", server.port());
  client.send(at(3));
  EXPECT_EQ(newest_of(server), 3);
}

// A peer that never reads fills its connection; the others are served on, and when it reads at
// last it finds whole messages only.
TEST(TransformStream, APeerThatDoesNotReadHoldsUpNobody) {
  TransformStream server(0);
  TransformStream lazy("127.0.0.1", server.port());
  TransformStream keen("127.0.0.1", server.port());
  EXPECT_TRUE(comes_true([&] { return server.send(at(0)) == 2; }));
  int refused = 0;
  int k = 1;
  for (; k < 200'000 && refused < 10; ++k) {
    refused += server.send(at(k)) < 2 ? 1 : 0;
    keen.receive();
  }
  EXPECT_EQ(refused, 10);
  EXPECT_GT(newest_of(lazy), 0);
  EXPECT_TRUE(comes_true([&] {
    lazy.receive();
    return server.send(at(k)) == 2;
  }));
  EXPECT_TRUE(comes_true([&] {
    const auto message = lazy.receive();
    return message && message->pose.translation().x() == k;
  }));
}

TEST(TransformStream, IdlePeersDoNotLockOutTheDevice) {
  TransformStream server(0);
  std::vector<std::unique_ptr<TransformStream>> idle;
  for (int k = 0; k < 40; ++k) {
    idle.push_back(std::make_unique<TransformStream>("127.0.0.1", server.port()));
    server.receive();
  }
  TransformStream device("127.0.0.1", server.port());
  device.send(at(7));
  EXPECT_EQ(newest_of(server), 7);
  EXPECT_LE(server.peers(), 16);
  for (int k = 0; k < 40; ++k) {
    idle.push_back(std::make_unique<TransformStream>("127.0.0.1", server.port()));
    server.receive();
  }
  device.send(at(8));
  EXPECT_EQ(newest_of(server), 8);
}

TEST(TransformStream, ListensWhereItIsTold) {
  EXPECT_GT(TransformStream(TransformStream::Listen{"0.0.0.0", 0}).port(), 0);
  EXPECT_GT(TransformStream(TransformStream::Listen{"127.0.0.2", 0}).port(), 0);
  TransformStream loopback(0);
  EXPECT_THROW(TransformStream("127.0.0.2", loopback.port()), FileError);
  EXPECT_THROW(TransformStream(TransformStream::Listen{"localhost", 0}), InvalidArgument);
}

TEST(TransformStream, RefusesWhatItCannotOpen) {
  TransformStream server(0);
  EXPECT_THROW(TransformStream(server.port()), FileError);
  EXPECT_THROW(TransformStream("nowhere", 5), InvalidArgument);
  EXPECT_THROW(TransformStream("127.0.0.1", 1), FileError);
}

}  // namespace
}  // namespace dyop
