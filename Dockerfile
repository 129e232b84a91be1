# Sentree in a small image that runs as nobody in particular:
#   docker build -t sentree . && docker run --rm sentree test examples/recharge
FROM debian:12 AS build
COPY . /sentree
WORKDIR /sentree
# The scripts install what is missing; only the command is built.
RUN bash -euc 'source scripts/common.sh; ensure_tools; build release sentree; strip build/release/bin/sentree build/release/lib/sentree/libsentree_dds.so'
# The libraries that the command, and what it loads for ROS 2, are linked with, for the image to come.
RUN ldd build/release/bin/sentree build/release/lib/sentree/libsentree_dds.so | awk '$3 ~ "^/" {print $3}' | xargs -n1 realpath | xargs dpkg -S | cut -d: -f1 | sort -u > /runtime-packages

FROM debian:12-slim
COPY --from=build /runtime-packages /runtime-packages
RUN apt-get update && xargs apt-get install -y --no-install-recommends < /runtime-packages \
  && rm -rf /var/lib/apt/lists/* /runtime-packages \
  && useradd --system --uid 10001 --create-home sentree
COPY --from=build /sentree/build/release/bin/sentree /opt/sentree/bin/sentree
COPY --from=build /sentree/build/release/lib/sentree/libsentree_dds.so /opt/sentree/lib/sentree/libsentree_dds.so
COPY --from=build /sentree/interfaces /opt/sentree/share/sentree/interfaces
COPY --from=build /sentree/skills /opt/sentree/share/sentree/skills
COPY --from=build /sentree/examples /opt/sentree/share/sentree/examples
ENV PATH=/opt/sentree/bin:$PATH
WORKDIR /opt/sentree/share/sentree
USER sentree
ENTRYPOINT ["sentree"]
CMD ["test", "examples/recharge"]
