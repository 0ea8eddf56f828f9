# shellcheck shell=bash disable=SC2154 # variables of test.sh
# Part of test.sh: starts docker/compose.scale.yaml with podman-compose. A job goes through the proxy, its events through
# the other server, and one whose worker is killed in the middle is done by another, once and with the same bytes. The
# ports 80 and 443 of this machine must be free.
readonly stack=$work/stack project=$name
export CREASED_DATABASE_PASSWORD=$RANDOM$RANDOM$RANDOM

compose() { podman-compose --project-name "$project" --file "$stack/compose.scale.yaml" "$@" >>"$work/compose.log" 2>&1; }
sql() { podman_ exec "${project}_postgresql_1" psql --no-psqlrc --tuples-only --no-align --user creased --command "$1"; }
call() { curl --silent --fail --cacert "$stack/tls/cert.pem" --header "Authorization: Bearer $(cat "$work/key")" "$@"; }
fail() {
  echo "FAILED: $*" >&2
  cat "$work/compose.log" >&2
  local container
  for container in {creased,worker}_{1,2} nginx_1 postgresql_1; do
    echo "--- $container" >&2
    podman_ logs --tail 20 "${project}_$container" >&2 || true
  done
  exit 1
}
clean() {
  compose down --volumes || true
  podman_ network rm --force "${project}_default" >/dev/null 2>&1 || true # and what is left in it
  rm -rf "$work"
}

# Images of the same name and interface, made of Debian's packages, where those of the compose file are not to be had.
make_postgresql() {
  cat >"$work/postgresql/start" <<'SCRIPT'
#!/bin/bash
set -euo pipefail
as_user=(setpriv --reuid postgres --regid postgres --init-groups)
if [[ ! -s $PGDATA/PG_VERSION ]]; then
  chown postgres "$PGDATA" && chmod 0700 "$PGDATA"
  "${as_user[@]}" initdb --username "$POSTGRES_USER" --encoding UTF8
  echo 'host all all all scram-sha-256' >>"$PGDATA/pg_hba.conf"
  echo "listen_addresses = '*'" >>"$PGDATA/postgresql.conf"
  "${as_user[@]}" postgres --single postgres <<<"ALTER ROLE $POSTGRES_USER PASSWORD '$POSTGRES_PASSWORD'
CREATE DATABASE $POSTGRES_DB"
fi
exec "${as_user[@]}" "$@"
SCRIPT
  cat >"$work/postgresql/Dockerfile" <<'FILE'
FROM debian:bookworm-slim
RUN apt-get update && DEBIAN_FRONTEND=noninteractive apt-get install --yes --no-install-recommends postgresql-15
COPY --chmod=0755 start /usr/local/bin/start
ENV PATH=/usr/lib/postgresql/15/bin:/usr/bin:/bin PGDATA=/var/lib/postgresql/data
VOLUME /var/lib/postgresql/data
STOPSIGNAL SIGINT
ENTRYPOINT ["/usr/local/bin/start"]
FILE
}
make_nginx() {
  cat >"$work/nginx/Dockerfile" <<'FILE'
FROM debian:bookworm-slim
RUN apt-get update && DEBIAN_FRONTEND=noninteractive apt-get install --yes --no-install-recommends nginx-light \
    && rm -rf /var/lib/nginx && ln --symbolic /var/cache/nginx /var/lib/nginx \
    && ln --symbolic --force /dev/stderr /var/log/nginx/error.log
CMD ["nginx", "-g", "daemon off;"]
FILE
}
take_image() { # IMAGE COMMAND
  podman image exists "$1" || podman pull --quiet "docker.io/library/$1" >/dev/null 2>&1 && return
  mkdir "$work/${2#make_}" && "$2" && build "docker.io/library/$1" "$work/${2#make_}/Dockerfile" "$work/${2#make_}"
}

prepare() {
  mkdir "$stack" "$stack/keys" "$stack/tls"
  cp docker/compose.scale.yaml docker/nginx.conf "$stack/"
  openssl req -x509 -newkey ec -pkeyopt ec_paramgen_curve:prime256v1 -nodes -days 2 -subj /CN=localhost \
    -addext subjectAltName=DNS:localhost -keyout "$stack/tls/key.pem" -out "$stack/tls/cert.pem" 2>/dev/null
  podman_ run "${limits[@]}" --rm --network none "$image" key alice >"$work/key.txt"
  head --lines 1 "$work/key.txt" >"$work/key"
  tail --lines 1 "$work/key.txt" | jq '{keys: [.]}' >"$stack/keys/keys.json"
  chmod 0755 "$work" "$stack" "$stack/keys" "$stack/tls" && chmod 0644 "$stack"/{keys/keys.json,tls/key.pem,nginx.conf}
  cat >"$work/containers.conf" <<'FILE'
[containers]
default_ulimits = ["nofile=20000:20000", "nproc=32768:32768"]
[engine]
runtime = "runc"
cgroup_manager = "cgroupfs"
events_logger = "file"
FILE
  export CONTAINERS_CONF=$work/containers.conf
  podman tag "$image" localhost/creased:latest
}

address_of() {
  podman_ container inspect --format '{{range .NetworkSettings.Networks}}{{.IPAddress}}{{end}}' "${project}_$1"
}
submit() { # ADDRESS QUERY
  call --data-binary "@$work/part.ply" --header 'Content-Type: model/ply' "$1/v1/jobs?name=part.ply&$2" | field .id
}
await() { # SECONDS COMMAND…
  local end=$((SECONDS + $1))
  until "${@:2}"; do
    ((SECONDS < end)) || return 1
    sleep 0.2
  done
}
answers() { call --output /dev/null "$1/readyz"; }
has_ended() { [[ $(sql "SELECT state FROM jobs WHERE id = '$1'") != @(queued|running) ]]; }
has_swept() { (($(call "$one/v1/jobs/$1" | field '.progress.sweep // 0') >= 3)); }

command -v podman-compose >/dev/null || fail "podman-compose is missing: docker/install-packages.sh image"
prepare
say "images of PostgreSQL and nginx" && take_image postgres:15 make_postgresql && take_image nginx:1.26 make_nginx
say "two servers, two workers, PostgreSQL and nginx start"
compose up --detach --no-build || fail "podman-compose does not start them"
one=$(address_of creased_1):8080 other=$(address_of creased_2):8080
readonly one other
for address in https://localhost "$one" "$other"; do
  await 120 answers "$address" || fail "$address is not ready"
done

say "a job through the proxy"
call https://localhost/v1/samples/part.ply --output "$work/part.ply"
job=$(call --header 'Prefer: wait=60' --data-binary "@$work/part.ply" --header 'Content-Type: model/ply' \
  'https://localhost/v1/jobs?name=part.ply')
[[ $(field .state <<<"$job") == succeeded ]] || fail "the job has not succeeded: $job"
code=$(curl --silent --insecure --output /dev/null --write-out '%{http_code}' https://localhost/v1/jobs)
[[ $code == 401 ]] || fail "a call without a key got $code"

say "submitted to one server, followed on the other, its worker killed in the middle"
readonly run='solver=metropolis&sweeps=3000&seed=7'
slow=$(submit "$one" "$run")
call --no-buffer "$other/v1/jobs/$slow/events" >"$work/events" &
await 60 has_swept "$slow" || fail "the job was not seen running"
holder=$(sql "SELECT lease_owner FROM jobs WHERE id = '$slow'")
podman_ kill --signal KILL "${holder%%-*}" >/dev/null
await 300 has_ended "$slow" || fail "the job is not done"
wait %%
ends=$(grep --count '"state":"succeeded"' "$work/events" || true)
attempt=$(call "$other/v1/jobs/$slow" | field .attempt)
((ends == 1 && attempt == 2)) || fail "$ends events say that it succeeded, in attempt $attempt"
echo "killed ${holder%%-*}, succeeded in attempt $attempt, told once on the other server"

say "the same bytes as without a kill"
again=$(submit "$other" "$run")
await 300 has_ended "$again" || fail "the second job is not done"
for id in "$slow" "$again"; do call "https://localhost/v1/jobs/$id/mesh.ply" --output "$work/$id.ply"; done
cmp "$work/$slow.ply" "$work/$again.ply" || fail "the results differ"

say "one server stopped: the proxy goes on with the other"
podman_ stop --time 30 "${project}_creased_1" >/dev/null
for _ in {1..10}; do
  [[ $(call "https://localhost/v1/jobs/$slow" | field .state) == succeeded ]] || fail "a call through the proxy failed"
done

say "the store"
sql "SELECT state, count(*), sum(attempt), sum(bytes) FROM jobs GROUP BY state"
[[ $(sql "SELECT count(*) FROM jobs WHERE state <> 'succeeded'") == 0 ]] || fail "a job has not succeeded"
lost=$(sql "SELECT count(*) FROM files WHERE bytes <>
  (SELECT coalesce(sum(length(bytes)), 0) FROM chunks WHERE blob = files.blob)")
[[ $lost == 0 ]] || fail "$lost files are not whole"
say "all passed"
